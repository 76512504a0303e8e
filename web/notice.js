// A notice above the page while its server does not answer.

import { fill, h } from "./dom.js";
import { on, state } from "./state.js";

/** Shows the notice whenever the connection is lost: `command` starts the server anew, `kept` says what is not lost. */
export function startNotice(command, kept) {
  on(["connection"], () => {
    const box = document.getElementById("notice");
    const says = {
      gone: ["The laboratory's server does not answer.", `${kept} This page goes on by itself when the same server is `
        + `back; when you start it anew (${command}), open the address that it prints.`],
      refused: ["This page's key is not valid any more.", "The laboratory was started anew, or the address is "
        + "incomplete: open the address that misclosure lab printed."],
    }[state.connection];
    box.hidden = !says;
    if (says) fill(box, h("strong", {}, says[0]), " ", says[1]);
    document.body.classList.toggle("lost", Boolean(says));
  });
}
