// What is chosen on the page, in one place. Parts say which keys they depend on and are called once when one changed.

const SAVED = "misclosure-lab-choices";
const saved = JSON.parse(localStorage.getItem(SAVED) ?? "{}");

export const state = {
  block: null, // answer of GET block
  tree: null, // answer of GET tree
  longest: "{}", // answer of GET longest, as text: it changes only where it says something else
  node: null, // id of the step that is looked at
  against: null, // id of the step that it is compared with; null: its parent
  peek: false, // the step before is shown in its place, as long as a key is held
  beside: false, // both, side by side
  predicted: null, // effect whose predicted picture is shown
  prediction: null, // what the null model says of it, in words
  brush: null, // list of brushes, or null
  brushedImages: null, // images of the brushed measurements: [{image, n, rms_px}]
  image: 0, // index of the image that is looked at
  fresh: null, // id of the step that has just been computed
  running: {}, // progress by step
  connection: "open", // open, gone, refused
  tab: "missing", // of the right column
  locked: saved.locked ?? true, // scales stay when another step is chosen
  views: saved.views ?? ["sensor", "plan", "profile", "images"],
  large: null, // view that has all the room
  against_quantity: saved.against_quantity ?? null,
  steps: saved.steps ?? true, // the left column is shown
  side: saved.side ?? true, // the right one
  theme: saved.theme ?? "auto",
};

const KEPT = ["steps", "side", "locked", "views", "against_quantity", "theme"];
const listeners = [];
let changed = new Set();

/** Calls `f` after any of `keys` changed, once for all changes that were made together. */
export function on(keys, f) {
  listeners.push([keys, f]);
}

/** Takes the changes over; what stays the same is no change. */
export function set(changes) {
  for (const [key, value] of Object.entries(changes)) {
    if (Object.is(state[key], value)) continue;
    state[key] = value;
    if (!changed.size) queueMicrotask(tell);
    changed.add(key);
  }
}

function tell() {
  const keys = changed;
  changed = new Set();
  if (KEPT.some((key) => keys.has(key))) {
    localStorage.setItem(SAVED, JSON.stringify(Object.fromEntries(KEPT.map((key) => [key, state[key]]))));
  }
  for (const [wanted, f] of listeners) if (wanted.some((key) => keys.has(key))) f();
}

/** The step of this id, or null. */
export const nodeOf = (id) => state.tree?.nodes.find((node) => node.id === id) ?? null;
export const chosen = () => nodeOf(state.node);
/** The step that the chosen one is compared with: the one picked for it, else its parent. */
export function before() {
  const picked = nodeOf(state.against);
  if (picked && picked.id !== state.node) return picked;
  return nodeOf(chosen()?.parent);
}
