// Asking for a step. What is asked for appears in the tree at once; the page goes to it when it is done, unless one went elsewhere meanwhile.

import { post } from "./api.js";
import { set, state } from "./state.js";
import { say } from "./progress.js";

/** Step that is to be shown once it is done, and the step that was looked at when it was asked for. */
let awaited = null;

export async function change(what) {
  const parent = state.node;
  try {
    const { id } = await post("steps", { parent, change: what });
    awaited = { id, from: parent, follow: what.kind === "improve" };
  } catch (error) {
    say("error", error.message);
  }
}

/** Called when step `id` is done. `improve` is followed from step to step. */
export function arrived(id) {
  const node = state.tree?.nodes.find((one) => one.id === id);
  const next = awaited && (awaited.id === id || (awaited.follow && node?.parent === state.node));
  if (!next || state.node !== awaited.from) return;
  awaited.from = id;
  set({ node: id, against: null, brush: state.brush });
}

export async function cancel(id) {
  try {
    await post(`steps/${id}/cancel`);
  } catch (error) {
    say("error", error.message);
  }
}
