// What figures cannot do: address bar, clipboard, downloads, arrow keys.
function save(address, name) {
  const link = document.createElement("a")
  link.href = address
  link.download = name
  document.body.appendChild(link)
  link.click()
  link.remove()
}

function show_address() {
  if (said.data.address[0]) history.replaceState(null, "", said.data.address[0])
}
said.properties.data.change.connect(show_address)
show_address()
file.properties.data.change.connect(() => {
  if (file.data.content[0]) save(file.data.content[0], file.data.name[0])
})

async function copy(button) {
  const text = said.data[button.dataset.copy][0]
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
