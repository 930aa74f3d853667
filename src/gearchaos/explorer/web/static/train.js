
// The scheme of a train: a part that is chosen, the verdicts on its meshes, and its natural modes.
const scheme = document.getElementById("scheme"), part_words = document.getElementById("part")
let verdicts = {}, chosen = null  // words by mesh; the name of the part and whether it is a mesh
function show_part() {
  if (chosen === null) return
  for (const each of scheme.querySelectorAll("[data-part]")) {
    const is_chosen = each.dataset.part === chosen.name && ("mesh" in each.dataset) === chosen.mesh
    each.classList.toggle("chosen", is_chosen)
    if (each.tagName === "BUTTON") each.setAttribute("aria-pressed", is_chosen)
    if (each.tagName === "BUTTON" && is_chosen) {
      const verdict = chosen.mesh && verdicts[chosen.name] ? `: ${verdicts[chosen.name].words}` : ""
      part_words.textContent = `${each.textContent} ${each.closest("tr").cells[1].firstChild.textContent}${verdict}`
    }
  }
}
function show_verdicts(found) {
  verdicts = found
  for (const each of scheme.querySelectorAll("[data-verdict]")) each.textContent = ` – ${verdicts[each.dataset.verdict]?.contact}`
  for (const each of scheme.querySelectorAll("g.mesh")) each.dataset.contact = verdicts[each.dataset.part]?.contact
  show_part()
}
scheme?.addEventListener("click", ({target}) => {
  const part = target.closest("[data-part]")
  if (!part) return
  chosen = {name: part.dataset.part, mesh: "mesh" in part.dataset}
  if (chosen.mesh) request("set", ["mesh", chosen.name])
  show_part()
})

const animate_button = scheme?.querySelector("[data-animate]")
if (animate_button) {
  const shapes = JSON.parse(scheme.querySelector("[data-shapes]").dataset.shapes), menu = scheme.querySelector("[name=mode]")
  let began = null
  const show_mode = (phase) => {
    for (const [name, [angle, x, y]] of Object.entries(shapes[menu.value])) {
      const body = scheme.querySelector(`g[data-part="${CSS.escape(name)}"]:not(.mesh)`)
      body.setAttribute("transform", `translate(${x * phase} ${y * phase}) rotate(${angle * phase} ${body.dataset.centre})`)
    }
  }
  const frame = (now) => {
    if (began === null) return
    show_mode(Math.sin((now - began) / 1000 * Math.PI))
    requestAnimationFrame(frame)
  }
  menu.addEventListener("change", () => { if (calm.matches) show_mode(1) })
  animate_button.addEventListener("click", () => {
    began = began === null && !calm.matches ? performance.now() : null
    animate_button.setAttribute("aria-pressed", began !== null)
    if (began !== null) requestAnimationFrame(frame)
    else show_mode(Number(calm.matches))  // at its largest where motion is not wanted
  })
}
