document.addEventListener("click", event => {
  const button = event.composedPath().find(node => node.dataset && (node.dataset.copy || node.dataset.link));
  if (!button) return;
  const text = button.dataset.copy || new URL(button.dataset.link, location.href).href, said = button.textContent;
  navigator.clipboard.writeText(text).then(
    () => { button.textContent = "copied"; setTimeout(() => { button.textContent = said }, 1200) },
    () => { getSelection().selectAllChildren(button.parentNode.querySelector("code")) });
});
addEventListener("popstate", () => { if (!location.hash) location.reload() }); // back: the state of that address
