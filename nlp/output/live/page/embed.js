// The live view inside another page: its elements are in a shadow tree, so that names and styles of both stay apart.

/**
 * Document of the view: its elements, or else those of the page whose names begin with `live-`.
 * @param {Document} page
 * @returns {any}
 */
const documentOf = (page) => {
  const host = /** @type {HTMLElement} */ (page.getElementById("live"));
  // From here on the page does not show the content of the host: the picture for pages without a script.
  const root = host.attachShadow({ mode: "open" });
  page.documentElement.classList.add("embedded");
  root.append(/** @type {HTMLTemplateElement} */ (page.getElementById("live-markup")).content);
  return {
    documentElement: host,
    body: root,
    /** @param {string} id */
    getElementById: (id) => root.getElementById(id) ?? page.getElementById(`live-${id}`),
    /** @param {string} text */
    querySelector: (text) => root.querySelector(text),
    /** @param {string} text */
    querySelectorAll: (text) => root.querySelectorAll(text),
    /** @param {string} name */
    createElement: (name) => page.createElement(name),
    /** @param {string} space @param {string} name */
    createElementNS: (space, name) => page.createElementNS(space, name),
    /** @param {string} type @param {any} act */
    addEventListener: (type, act) => page.addEventListener(type, act),
    get activeElement() {
      return root.activeElement;
    },
  };
};

/** Stand-in for the document in the scripts of the view, which are in the scope of this one. */
export const document = documentOf(globalThis.document);
