"use strict";
// Mark tables that are wider than the page.
const wider = new ResizeObserver((entries) => entries.forEach(({ target }) => target.classList.toggle("wider", target.scrollWidth > target.clientWidth + 1)));
document.querySelectorAll(".scroll").forEach((each) => wider.observe(each));
