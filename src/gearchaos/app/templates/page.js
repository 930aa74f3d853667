// What figures cannot do: address bar, clipboard, downloads, arrow keys.
const texts = {}

function save(address, name) {
  const link = document.createElement("a")
  link.href = address
  link.download = name
  document.body.appendChild(link)
  link.click()
  link.remove()
}

function heed() {
  const kind = said.data.kind[0], text = said.data.text[0]
  if (kind === "address") history.replaceState(null, "", text)
  else if (kind === "download") save(text, said.data.name[0])
  else texts[kind] = text
}
said.properties.data.change.connect(heed)

async function copy(button) {
  const text = texts[button.dataset.copy] || ""
  try {
    await navigator.clipboard.writeText(text)
  } catch {
    const area = document.createElement("textarea")
    area.value = text
    document.body.appendChild(area)
    area.select()
    document.execCommand("copy")
    area.remove()
  }
  const before = button.textContent
  button.textContent = "copied"
  setTimeout(() => { button.textContent = before }, 1200)
}
for (const button of document.querySelectorAll("[data-copy]"))
  button.addEventListener("click", () => copy(button))

let number = 0
function typing(event) {
  const at = event.composedPath()[0]
  return at && at.tagName && (["INPUT", "SELECT", "TEXTAREA"].includes(at.tagName) || at.getAttribute("role") === "slider"
    || (at.className && String(at.className).includes("noUi")))
}
document.addEventListener("keydown", (event) => {
  if (!event.key.startsWith("Arrow") || typing(event) || event.ctrlKey || event.metaKey || event.altKey) return
  event.preventDefault()
  number += 1
  heard.data = {key: [event.key], size: [event.shiftKey ? 10 : 1], number: [number]}
})
document.body.dataset.ready = "1"
