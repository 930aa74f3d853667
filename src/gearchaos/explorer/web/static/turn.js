
// The teeth of a drawing turn with the motion at the point. They are drawn at an instant of the mesh period; a pitch later
// they look the same. Wheel 2 runs ahead by the gap at the driving flanks, enlarged.
const turn_button = document.querySelector("[data-turn]"), turn_words = document.getElementById("gap")
const calm = matchMedia("(prefers-reduced-motion: reduce)")
const turning_speed = 0.4  // mesh periods in a second
let teeth = null, motion = null, turned = 0, before = null  // before: time of the last frame, ms; null unless it turns
function turn_to(periods) {
  const svg = document.querySelector("#sheet svg")
  if (!svg || !teeth || !motion) return
  const at = periods * motion.samples, whole = Math.floor(at), share = at - whole, count = motion.gaps.length
  const gap = motion.gaps[whole % count] * (1 - share) + motion.gaps[(whole + 1) % count] * share
  const passed = periods - teeth.phase, shift = (passed - Math.round(passed)) * teeth.pitch
  const lengths = [shift, -shift - 1e-3 * gap * teeth.enlarged]
  for (const [wheel, shape] of svg.querySelectorAll("polygon").entries()) {
    if (shape.dataset.turned !== teeth.number) shape.setAttribute("points", teeth.outlines[wheel])
    shape.dataset.turned = teeth.number
    const degrees = lengths[wheel] / teeth.bases[wheel] * 180 / Math.PI
    shape.setAttribute("transform", `rotate(${degrees} ${teeth.centres[wheel].join(" ")})`)
  }
  svg.setAttribute("viewBox", teeth.box)
  svg.classList.add("turning")
  svg.classList.toggle("apart", gap > 0)
  turn_words.value = `${gap > 0 ? "gap" : "deflection"} ${Math.abs(gap).toFixed(1)} µm, drawn ${teeth.enlarged} times as large`
}
function turn_frame(now) {
  if (before === null) return
  turned += (now - before) / 1000 * turning_speed
  before = now
  turn_to(turned)
  requestAnimationFrame(turn_frame)
}
function set_turning(on) {
  before = on ? performance.now() : null
  turn_button.setAttribute("aria-pressed", on)
  if (on) requestAnimationFrame(turn_frame)
}
let teeth_number = 0
function show_turning(values) {
  if (values.teeth) teeth = {...JSON.parse(values.teeth), number: `${teeth_number += 1}`}
  if (values.gaps !== undefined) motion = JSON.parse(values.gaps)
  if (!turn_button) return
  turn_button.disabled = !teeth || !motion
  if (turn_button.disabled) set_turning(false)
}
if (turn_button) {
  const words = turn_button.querySelector("span")
  const name_button = () => { words.textContent = calm.matches ? "▷ turn by an eighth of a pitch" : "▶ turn with the motion" }
  calm.addEventListener("change", name_button)
  name_button()
  turn_button.addEventListener("click", () => {
    if (calm.matches) turn_to(turned += 1 / 8)
    else set_turning(before === null)
  })
}
