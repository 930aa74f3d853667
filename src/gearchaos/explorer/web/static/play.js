
// A run-up. All of it is here before it is played, so that playing asks nothing of the server. The clock is that of the
// sound, if there is some.
const play_button = document.querySelector("[data-press=run]"), sound_button = document.querySelector("[data-press=run-sound]")
const audio = document.getElementById("run-audio"), readout = document.getElementById("run-now")
let run = {}, began = null, heard = false, drawn = 0  // began: null unless it is being played; times in ms
const sounds = () => Boolean(run.sound) && sound_button.getAttribute("aria-pressed") === "true"
const passed = (speeds, speed, down) => speeds.filter((each) => down ? each >= speed : each <= speed).length
const set_points = (id, [x, y], count) => set_attributes(id, {data: {x: x.slice(0, count), y: y.slice(0, count)}})
function show_instant(seconds) {
  const way = Math.min(Math.floor(seconds / run.duration), run.lines.length - 1), share = seconds / run.duration - way
  const speed = run.start + (run.stop - run.start) * (way ? 1 - share : share), down = way === 1
  run.lines.forEach((line, i) => set_points(
    run.line_ids[i], line, i < way ? line[0].length : i > way ? 0 : passed(line[0], speed, down)))
  const jumps = run.jumps.slice(0, way + 1).map((each, i) => {
    const count = i < way ? each[0].length : passed(each[0], speed, down)
    return each.map((values) => values.slice(0, count))
  })
  set_points(run.jump_id, [jumps.flatMap((each) => each[0]), jumps.flatMap((each) => each[1])])
  if (run.shown_way !== way) set_attributes(run.image_id, {data: run.images[run.shown_way = way]})
  for (const id of run.now_ids) set_attributes(id, {location: speed, visible: true})
  const at = {x: run.at[0], y: run.at[1], [run.axis]: speed}
  if (run.axis) set_attributes(run.runner_id, {data: {x: [at.x], y: [at.y]}})
  const count = passed(run.lines[way][0], speed, down)
  const value = run.lines[way][1][Math.max(count, 1) - 1].toPrecision(3)
  readout.value = `${seconds.toFixed(1)} s  ${speed.toFixed(0)} rpm  ${run.measure} ${value} ${run.unit}`
}
function next_frame(now) {
  if (began === null) return
  const seconds = heard ? audio.currentTime : (now - began) / 1000, end = run.duration * run.lines.length
  if (now - drawn > 30) {  // Bokeh draws for some milliseconds
    drawn = now
    show_instant(Math.min(Math.max(seconds, 0), end))
  }
  if (seconds >= end || (heard && audio.ended)) {
    show_instant(end)
    stop_playing()
  } else requestAnimationFrame(next_frame)
}
function play() {
  play_button.setAttribute("aria-pressed", true)
  began = performance.now()
  heard = sounds()
  if (heard) {
    audio.currentTime = 0
    audio.play().catch((error) => {
      if (error.name !== "NotAllowedError") return
      heard = false
      show_note("the browser wants another click on play before it sounds")
    })
  }
  show_instant(0)
  requestAnimationFrame(next_frame)
}
function stop_playing() {
  began = null
  audio.pause()
  play_button.setAttribute("aria-pressed", false)
}
const plain = (value) => value instanceof Map ? Object.fromEntries(value) : value
run_up.properties.data.change.connect(() => {
  if (!play_button) return  // a page without gears
  if (run.runner_id) set_attributes(run.runner_id, {data: {x: [], y: []}})
  stop_playing()
  run = plain(run_up.data.run[0])
  if (!run.lines) {
    audio.removeAttribute("src")
    readout.value = ""
    return
  }
  if (run.sound) audio.src = run.sound
  play()
})
if (play_button) {
  play_button.addEventListener("click", (event) => {
    if (!run.lines) {  // to be computed, or to be cancelled
      play_button.setAttribute("aria-pressed", play_button.getAttribute("aria-pressed") !== "true")
      return
    }
    event.stopPropagation()  // the server has nothing to do
    if (began === null) play()
    else stop_playing()
  })
  sound_button.addEventListener("click", () => { audio.muted = sound_button.getAttribute("aria-pressed") === "true" })
}
