// The parts of the page beside the figures: texts, form, buttons, arrow keys, address bar, clipboard, downloads.
// Bokeh runs this once the page is loaded, with the data sources page_state, updates, download and requests; what each
// is for is described in gearchaos.explorer.web.messages.

// Changes to Bokeh that save two thirds of the time of drawing. Bokeh asks the browser for the computed style of every
// line and label, in case a style sheet sets it, and for the font size; and it lays out and draws a figure again whenever
// its tick labels become shorter. It measures these labels even if only what lies above the figure moves, as the
// crosshair does, and lays out what stands beside the pointer again. Glyphs above the figure are clipped like
// the figure itself.
const patches = {
  "core/visuals/visual": ({VisualProperties}) => { VisualProperties.prototype._get_css_value = () => "" },
  "models/plots/plot_canvas": ({PlotView}) => {
    const {_invalidate_layout_if_needed} = PlotView.prototype
    PlotView.prototype._invalidate_layout_if_needed = function () {
      const overlays = [...this._invalidated_painters].every((painter) => painter.model.level === "overlay")
      if (this._needs_layout || this._invalidate_all || !overlays) _invalidate_layout_if_needed.call(this)
    }
    const {get} = Object.getOwnPropertyDescriptor(PlotView.prototype, "base_font_size")
    Object.defineProperty(PlotView.prototype, "base_font_size", {get() { return this._font_size ??= get.call(this) }})
  },
  "core/layout/side_panel": ({SideLayout}) => {
    SideLayout.prototype.has_size_changed = function () {
      const {width, height} = this._content_size()
      return this.panel.is_horizontal ? this.bbox.height < height : this.bbox.width < width
    }
  },
  "models/ui/tooltip": ({Tooltip}) => {
    const {show} = Tooltip.prototype
    Tooltip.prototype.show = function ({x, y}) {
      const shown = JSON.stringify([x, y, this.content.textContent])
      if (this.position === null || shown !== this._shown) show.call(this, {x, y})
      this._shown = shown
    }
  },
  "models/renderers/glyph_renderer": ({GlyphRendererView}) => {
    Object.defineProperty(GlyphRendererView.prototype, "needs_clip", {get: () => true})
  },
}
for (const [name, patch] of Object.entries(patches)) {
  try {
    patch(Bokeh.require(name))
  } catch (error) {
    console.info(`Bokeh is not patched in ${name}: figures are drawn more slowly`, error)
  }
}

const entries = (map) => map instanceof Map ? map.entries() : Object.entries(map)
function set_attributes(id, attributes) {
  try {
    updates.document.get_model_by_id(id).setv(Object.fromEntries(entries(attributes)), {sync: false})
  } catch (error) {
    console.error(`model ${id} could not be changed`, error)  // the other models still can
  }
}
const unfolded = new Map()  // whether each group of fields that can be folded was open when it was last on the page
function replace_content(element, html) {
  for (const group of element.querySelectorAll("details")) unfolded.set(group.id, group.open)
  element.innerHTML = html
  for (const group of element.querySelectorAll("details")) group.open = unfolded.get(group.id) ?? group.open
}
updates.properties.data.change.connect(() => {
  for (const [id, attributes] of entries(updates.data.models[0])) set_attributes(id, attributes)
  for (const [name, html] of entries(updates.data.html[0])) {
    const element = document.getElementById(name)
    if (element) replace_content(element, html)  // a page without gears has no run-up and no assessment
  }
  const values = Object.fromEntries(entries(updates.data.values[0]))
  if (values.drawing) show_drawing(JSON.parse(values.drawing))
  show_turning(values)
  if (values.verdicts && scheme) show_verdicts(JSON.parse(values.verdicts))
  show_values(values)
})

// The form of a drawing: a plain number gets the unit that is chosen beside it.
const boxes = (row) => [...row.querySelectorAll("input, select:not(.unit)")]
function drawn_text(row) {
  const unit = row.querySelector(".unit")
  const texts = boxes(row).map(({value}) => value.trim()).map((text) =>
    unit && /^[-+]?[\d.,][-+\d.,eE/ ]*$/.test(text) ? `${text} ${unit.value}` : text)
  while (texts.length && !texts.at(-1)) texts.pop()
  return texts.join(";")
}
function show_drawing(marks) {
  for (const row of document.querySelectorAll("[data-key]")) {
    const {assumed, error, note} = marks[row.dataset.key]
    const all = boxes(row), unit = row.querySelector(".unit")
    row.classList.toggle("wrong", Boolean(error))
    const said = row.querySelector(".said") ?? row
    said.textContent = error || note
    for (const [number, box] of all.entries()) {
      const text = number && all[0].value ? "as wheel 1" : assumed[number] ?? "as wheel 1"
      const shown = (unit && text.endsWith(` ${unit.value}`) ? text.slice(0, -unit.value.length - 1) : text) || "not given"
      if (box.tagName === "SELECT") box.options[0].textContent = shown
      else box.placeholder = shown
      box.setAttribute("aria-invalid", Boolean(error))
    }
  }
}
function send_drawing() {
  const rows = [...document.querySelectorAll("#form [data-key]")].filter((row) => row.dataset.key)
  request("draw", rows.map((row) => [row.dataset.key, drawn_text(row)]).filter(([, text]) => text))
}
document.addEventListener("change", ({target}) => {
  if (target.closest("#form")) send_drawing()
})

// The form. Fields that are being edited are not changed.
const edited = new WeakSet()
function show_values(values) {
  for (const element of document.querySelectorAll("[data-set], [data-show]")) {
    const value = values[element.dataset.set ?? element.dataset.show]
    if (value === undefined || edited.has(element)) continue
    if (element.tagName === "BUTTON") element.setAttribute("aria-pressed", value)
    else if (element.type !== "range") element.value = value
    else if (!element.matches(":active")) set_slider(element, Number(value))
  }
}
function set_slider(slider, value) {
  if (value < slider.min) slider.min = value
  if (value > slider.max) slider.max = value
  slider.value = value
}
const moved_sliders = new Map()  // values by name, sent once per frame
function send_sliders() {
  for (const [name, value] of moved_sliders) request("set", [name, value])
  moved_sliders.clear()
}
document.addEventListener("input", ({target}) => {
  if (target.type === "text") edited.add(target)
  if (target.type !== "range") return
  if (moved_sliders.size === 0) requestAnimationFrame(send_sliders)
  moved_sliders.set(target.dataset.set, target.valueAsNumber)
  target.nextElementSibling.value = Number(target.valueAsNumber.toPrecision(10))
})
document.addEventListener("change", ({target}) => {
  edited.delete(target)
  if (target.dataset.set && target.type !== "range") request("set", [target.dataset.set, target.value])
})
document.addEventListener("focusout", ({target}) => edited.delete(target))

function save_file(address, name) {
  const link = document.createElement("a")
  link.href = address
  link.download = name
  document.body.appendChild(link)
  link.click()
  link.remove()
}

function show_address() {
  if (page_state.data.address[0]) history.replaceState(null, "", page_state.data.address[0])
}
page_state.properties.data.change.connect(show_address)
show_address()
download.properties.data.change.connect(() => {
  if (download.data.content[0]) save_file(download.data.content[0], download.data.name[0])
})

let note_timeout
function show_note(text) {
  const element = document.getElementById("note")
  element.textContent = text
  clearTimeout(note_timeout)
  note_timeout = setTimeout(() => { element.textContent = "" }, 2500)
}
async function copy(button) {
  const text = page_state.data[button.dataset.copy][0]
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
  show_note(`copied: ${text.split("\n").length} lines of ${button.textContent.split(" ").pop()}`)
}
for (const button of document.querySelectorAll("[data-copy]"))
  button.addEventListener("click", () => copy(button))

// The export menu closes with the next click or with Escape. On a phone the parameters are folded at first.
const menu = document.getElementById("export")
document.addEventListener("click", ({target}) => {
  if (!target.closest("#export summary")) menu.open = false
})
document.addEventListener("keydown", ({key}) => {
  if (key === "Escape") menu.open = false
})
if (matchMedia("(max-width: 760px)").matches) document.getElementById("controls").open = false

const steps = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}
let number = 0  // makes a request differ from the one before, else Bokeh would not send it
function request(action, value) {
  number += 1
  requests.data = {action: [action], value: [value], number: [number]}
}

document.addEventListener("keydown", (event) => {
  const typing = ["INPUT", "SELECT", "TEXTAREA"].includes(event.target.tagName)
  if (!(event.key in steps) || typing || event.ctrlKey || event.metaKey || event.altKey) return
  event.preventDefault()
  const size = event.shiftKey ? 10 : 1
  request("step", steps[event.key].map((n) => n * size))
})
document.addEventListener("click", ({target}) => {
  const range = target.closest("[data-range]")
  if (range) request("range", Number(range.dataset.range))
  const button = target.closest("button")
  if (!button) return
  const {choice, press, save, basins} = button.dataset
  if (choice !== undefined) request("choose", Number(choice))
  if (press !== undefined) request("press", press)
  if (save !== undefined) request("save", save)
  if (basins !== undefined) request("basins", null)
})
request("ready", null)
const is_edited = (box) => box.tagName === "INPUT" ? box.value !== box.defaultValue
  : box.value !== (([...box.options].find(({defaultSelected}) => defaultSelected) ?? box.options[0]).value)
if ([...document.querySelectorAll("#form :is(input, select)")].some(is_edited)) send_drawing()  // before this ran
document.body.dataset.ready = "1"
