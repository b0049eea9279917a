"use strict";
document.documentElement.classList.add("scripted");

/** A new element with attributes (functions become listeners) and children (strings become text). */
function make(tag, attributes, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes || {})) {
    if (typeof value === "function") element.addEventListener(name, value);
    else element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

/** So many significant digits with a typographic minus. */
function shown(value, digits = 5) {
  return Number(value.toPrecision(digits)).toString().replace("-", "\u2212").replace("e-", "e\u2212");
}
