document.addEventListener("click", event => {
  const button = event.composedPath().find(node => node.dataset && (node.dataset.copy || node.dataset.link));
  if (!button) return;
  const text = button.dataset.copy || new URL(button.dataset.link, location.href).href, said = button.textContent;
  navigator.clipboard.writeText(text).then(
    () => { button.textContent = "copied"; setTimeout(() => { button.textContent = said }, 1200) },
    () => { getSelection().selectAllChildren(button.parentNode.querySelector("code")) });
});
document.addEventListener("focusin", event => { // the handle of a slider has its value, but no name for screen readers
  const handle = event.composedPath()[0], title = handle.getRootNode().querySelector?.(".bk-slider-title");
  if (title && handle.getAttribute("role") === "slider") handle.setAttribute("aria-label", title.textContent.split(":")[0]);
});
let pushed = 0;
const push = history.pushState.bind(history);
history.pushState = (...entry) => { // a drag of a slider is one entry
  performance.now() - pushed < 1000 ? history.replaceState(...entry) : push(...entry);
  pushed = performance.now();
};
addEventListener("popstate", () => { if (!location.hash) location.reload() }); // back: the state of that address
