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
addEventListener("popstate", () => { if (!location.hash) location.reload() }); // back: the state of that address
