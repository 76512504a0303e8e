// The order of the tree's rows, and the lane of each.

/** Nodes in the order of their rows, with lane and row of the parent. Branches come before the main line goes on. */
export function rows(nodes) {
  const children = new Map();
  for (const node of nodes) children.set(node.parent, [...(children.get(node.parent) ?? []), node]);
  const out = [];
  const walk = (node, lane, above) => {
    const row = out.length;
    out.push({ node, lane, above });
    const [first, ...branches] = children.get(node.id) ?? [];
    branches.forEach((branch) => walk(branch, lane + 1, row));
    if (first) walk(first, lane, row);
  };
  for (const root of children.get(null) ?? []) walk(root, 0, null);
  return out;
}
