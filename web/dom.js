// Elements from code. Text goes in as text, never as markup: names in a block may hold anything.

/** `h("div.row", {title: "..", onclick: f, data: {node: 3}}, "text", child, ...)`; null, undefined and false children
 * are left out. */
export function h(tag, attributes, ...children) {
  const [name, ...classes] = tag.split(".");
  const element = document.createElement(name || "div");
  if (classes.length) element.className = classes.join(" ");
  for (const [key, value] of Object.entries(attributes ?? {})) {
    if (value === null || value === undefined || value === false) continue;
    if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
    else if (key === "data") Object.assign(element.dataset, value);
    else if (key in element && typeof value !== "string") element[key] = value;
    else element.setAttribute(key, value === true ? "" : value);
  }
  element.append(...children.flat().filter((child) => child !== null && child !== undefined && child !== false));
  return element;
}

/** The same for SVG. */
export function svg(name, attributes = {}, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

/** Puts `children` in place of what `parent` holds; what had the focus, or what stands for it now, keeps it. */
export function fill(parent, ...children) {
  const active = document.activeElement;
  const name = parent.contains(active) && active !== parent ? nameOf(active) : null;
  parent.replaceChildren(...children.flat().filter((child) => child !== null && child !== undefined
    && child !== false));
  if (name && document.activeElement !== active) [...parent.querySelectorAll("button, select, input, [tabindex]")]
    .find((one) => nameOf(one) === name)?.focus({ preventScroll: true });
}

const nameOf = (element) => [element.tagName, element.id,
  element.dataset.effect ?? element.ariaLabel ?? element.textContent].join(" ");

/** A button; `title` says what it does, `key` names its key. */
export function button(label, onclick, { title, key, kind, ...rest } = {}) {
  const hint = key ? `${title ?? label} (${key})` : title;
  return h(kind ? `button.${kind}` : "button", { type: "button", title: hint, onclick, ...rest }, label);
}

/** A choice among `[value, label]`. */
export function choice(label, options, value, onchange) {
  const select = h("select", { "aria-label": label, title: label, onchange: () => onchange(select.value) },
    options.map(([id, text]) => h("option", { value: String(id), selected: String(id) === String(value) }, text)));
  return select;
}

/** A modal dialog with a heading; removed when it closes. */
export function dialog(heading, ...content) {
  const close = () => box.close();
  const box = h("dialog", { onclose: () => box.remove(), onclick: (event) => event.target === box && close() },
    h("header", {}, h("h2", {}, heading), button("×", close, { title: "Close", key: "Esc", kind: "plain" })),
    h("div.content", {}, ...content));
  document.body.append(box);
  box.showModal();
  return box;
}

/** Calls `f` once, `ms` after the last call. */
export function later(ms, f) {
  let timer = 0;
  const call = (...values) => {
    clearTimeout(timer);
    timer = setTimeout(() => f(...values), ms);
  };
  call.cancel = () => clearTimeout(timer);
  return call;
}
