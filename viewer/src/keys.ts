/** Keys of the page: they are its own while no text is entered, also after a list was used with the pointer. */

/** Give a key to the page where the focus stayed in a closed list that the pointer, not the Tab key, had opened. */
export function ownKeys(): void {
  let tabbed = false;
  window.addEventListener("pointerdown", () => { tabbed = false; }, true);
  const pass = (e: KeyboardEvent) => {
    const focus = document.activeElement;
    if (e.key === "Tab") { tabbed = true; return; }
    if (!e.isTrusted || tabbed || !(focus instanceof HTMLInputElement)) return;
    if (!focus.readOnly || focus.getAttribute("role") !== "combobox" || focus.getAttribute("aria-expanded") === "true") return;
    focus.blur();
    e.stopImmediatePropagation();
    e.preventDefault();
    document.body.dispatchEvent(new KeyboardEvent(e.type, e));
  };
  window.addEventListener("keydown", pass, true);
}
