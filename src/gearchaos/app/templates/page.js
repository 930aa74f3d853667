// What figures cannot do: words, address bar, clipboard, downloads, buttons, arrow keys.

// Bokeh asks the browser for the style of every line and letter it draws, in case a style sheet sets it, and for the size
// of letters; it lays a figure out and draws it again whenever its tick labels get shorter. That takes two thirds of the
// time of drawing, and nothing here needs it. What lies above a figure is to be clipped like the figure itself.
const short_cuts = {
  "core/visuals/visual": ({VisualProperties}) => { VisualProperties.prototype._get_css_value = () => "" },
  "models/plots/plot_canvas": ({PlotView}) => {
    const {get} = Object.getOwnPropertyDescriptor(PlotView.prototype, "base_font_size")
    Object.defineProperty(PlotView.prototype, "base_font_size", {get() { return this._letters ??= get.call(this) }})
  },
  "core/layout/side_panel": ({SideLayout}) => {
    SideLayout.prototype.has_size_changed = function () {
      const {width, height} = this._content_size()
      return this.panel.is_horizontal ? this.bbox.height < height : this.bbox.width < width
    }
  },
  "models/renderers/glyph_renderer": ({GlyphRendererView}) => {
    Object.defineProperty(GlyphRendererView.prototype, "needs_clip", {get: () => true})
  },
}
for (const [name, take] of Object.entries(short_cuts)) {
  try {
    take(Bokeh.require(name))
  } catch (error) {
    console.info(`figures are drawn without a short cut through ${name}`, error)
  }
}

const entries = (map) => map instanceof Map ? map.entries() : Object.entries(map)
news.properties.data.change.connect(() => {
  for (const [id, attributes] of entries(news.data.models[0]))
    news.document.get_model_by_id(id).setv(Object.fromEntries(entries(attributes)), {sync: false})
  for (const [name, html] of entries(news.data.words[0])) document.getElementById(name).innerHTML = html
})

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

const steps = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}
let number = 0
function hear(what, value) {
  number += 1
  heard.data = {what: [what], value: [value], number: [number]}
}

function typing(event) {
  const at = event.composedPath()[0]
  return at && at.tagName && (["INPUT", "SELECT", "TEXTAREA"].includes(at.tagName) || at.getAttribute("role") === "slider"
    || (at.className && String(at.className).includes("noUi")))
}
document.addEventListener("keydown", (event) => {
  if (!(event.key in steps) || typing(event) || event.ctrlKey || event.metaKey || event.altKey) return
  event.preventDefault()
  const size = event.shiftKey ? 10 : 1
  hear("step", steps[event.key].map((n) => n * size))
})
document.addEventListener("click", ({target}) => {
  const button = target.closest("button")
  if (!button) return
  const {choice, save, basins} = button.dataset
  if (choice !== undefined) hear("choose", Number(choice))
  if (save !== undefined) hear("save", save)
  if (basins !== undefined) hear("basins", null)
})
hear("there", null)
document.body.dataset.ready = "1"
