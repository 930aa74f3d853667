// What figures cannot do: words, fields and lists, buttons, arrow keys, address bar, clipboard, downloads.

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
function change(id, attributes) {
  try {
    news.document.get_model_by_id(id).setv(Object.fromEntries(entries(attributes)), {sync: false})
  } catch (error) {
    console.error(`model ${id} could not be changed`, error)  // but all others can
  }
}
news.properties.data.change.connect(() => {
  for (const [id, attributes] of entries(news.data.models[0])) change(id, attributes)
  for (const [name, html] of entries(news.data.words[0])) document.getElementById(name).innerHTML = html
  show_values(Object.fromEntries(entries(news.data.values[0])))
})

// Fields and lists: what is being typed or dragged is left alone.
const typed = new WeakSet()
function show_values(values) {
  for (const element of document.querySelectorAll("[data-set], [data-show]")) {
    const value = values[element.dataset.set ?? element.dataset.show]
    if (value === undefined || typed.has(element)) continue
    if (element.tagName === "BUTTON") element.setAttribute("aria-pressed", value)
    else if (element.type !== "range") element.value = value
    else if (!element.matches(":active")) slide(element, Number(value))
  }
}
function slide(slider, value) {
  if (value < slider.min) slider.min = value
  if (value > slider.max) slider.max = value
  slider.value = value
}
const slid = new Map()
function tell_slid() {
  for (const [name, value] of slid) hear("set", [name, value])
  slid.clear()
}
document.addEventListener("input", ({target}) => {
  if (target.type === "text") typed.add(target)
  if (target.type !== "range") return
  if (slid.size === 0) requestAnimationFrame(tell_slid)
  slid.set(target.dataset.set, target.valueAsNumber)
  target.nextElementSibling.value = Number(target.valueAsNumber.toPrecision(10))
})
document.addEventListener("change", ({target}) => {
  typed.delete(target)
  if (target.dataset.set && target.type !== "range") hear("set", [target.dataset.set, target.value])
})
document.addEventListener("focusout", ({target}) => typed.delete(target))

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

let fading
function note(text) {
  const place = document.getElementById("note")
  place.textContent = text
  clearTimeout(fading)
  fading = setTimeout(() => { place.textContent = "" }, 2500)
}
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
  note(`copied: ${text.split("\n").length} lines of ${button.textContent.split(" ").pop()}`)
}
for (const button of document.querySelectorAll("[data-copy]"))
  button.addEventListener("click", () => copy(button))

// The menu closes once something is chosen, or where something else is pressed; on a phone parameters are folded away.
const menu = document.getElementById("export")
document.addEventListener("click", ({target}) => {
  if (!target.closest("#export summary")) menu.open = false
})
document.addEventListener("keydown", ({key}) => {
  if (key === "Escape") menu.open = false
})
if (matchMedia("(max-width: 760px)").matches) document.getElementById("controls").open = false

const steps = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}
let number = 0
function hear(what, value) {
  number += 1
  heard.data = {what: [what], value: [value], number: [number]}
}

document.addEventListener("keydown", (event) => {
  const own = ["INPUT", "SELECT", "TEXTAREA"].includes(event.target.tagName)
  if (!(event.key in steps) || own || event.ctrlKey || event.metaKey || event.altKey) return
  event.preventDefault()
  const size = event.shiftKey ? 10 : 1
  hear("step", steps[event.key].map((n) => n * size))
})
document.addEventListener("click", ({target}) => {
  const button = target.closest("button")
  if (!button) return
  const {choice, press, save, basins} = button.dataset
  if (choice !== undefined) hear("choose", Number(choice))
  if (press !== undefined) hear("press", press)
  if (save !== undefined) hear("save", save)
  if (basins !== undefined) hear("basins", null)
})
hear("there", null)
document.body.dataset.ready = "1"
