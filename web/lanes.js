// The order of the tree's rows, and the lane of each.

/**
 * Nodes in the order of their rows, with lane and row of the parent. The first child goes on in its parent's lane. What
 * branched off later stands
 * below, the newest last, in a lane that no row between it and its parent has.
 */
export function rows(nodes) {
  const children = new Map();
  for (const node of nodes) children.set(node.parent, [...(children.get(node.parent) ?? []), node]);
  const out = [];
  const walk = (node, lane, above) => {
    const row = out.length;
    out.push({ node, lane, above });
    const [first, ...branches] = children.get(node.id) ?? [];
    if (first) walk(first, lane, row);
    for (const branch of branches) walk(branch, 1 + Math.max(lane, ...out.slice(row + 1).map((one) => one.lane)), row);
  };
  for (const root of children.get(null) ?? []) walk(root, 0, null);
  return out;
}
