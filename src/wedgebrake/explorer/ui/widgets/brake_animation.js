// The brake in motion: a rotor seen along its shaft, the brake on it, and the forces between them,
// at one instant; and the playback controls. Samples come from the Bokeh source
// "motion", cursors go to "scrub-history", "scrub-phase" and "scrub-torque", all within the browser.

const SECONDS = 2            // duration of a period of the torque at the middle speed [s]
const SPEEDS = [0.25, 0.5, 1, 2, 4]
const FRAME = 33, FRAME_CALM = 250   // [ms] between pictures
const R = 104                // radius of the rotor [px]
const SWING = 0.7            // approximate magnified swing of the rotor [rad]
const FASTEST = 9            // largest speed of the drawn rotor [rad/s]
const MOST = 1e4             // largest magnification
const LONGEST = 60           // arrow of the largest actuation force [px]
const WIDEST = 1.1           // arc of the largest brake torque [rad]
const MOST_ROWS = 6          // lines of words on contacts
const LEAST_SCALE = 66       // of sketches [px per unit], at which words fit

const HATCH = `<defs><pattern id="hatch" width="5" height="5" patternUnits="userSpaceOnUse"
  patternTransform="rotate(45)"><rect width="5" height="5" fill="#F4F5F7"/>
  <path d="M0,0L0,5" stroke="#9AA5B1" stroke-width="1.4"/></pattern></defs>`
const COLOURS = {sticking: "#D55E00", sliding: "#0072B2", released: "#8A94A0"}
const clamp = (x, low, high) => Math.min(Math.max(x, low), high)
const polar = (r, a) => [r * Math.sin(a), -r * Math.cos(a)]     // a from the top, clockwise
const xy = (p) => `${p[0].toFixed(1)},${p[1].toFixed(1)}`

function arc(r, from, to) {
  const large = Math.abs(to - from) > Math.PI ? 1 : 0
  return `M${xy(polar(r, from))}A${r},${r} 0 ${large} ${to > from ? 1 : 0} ${xy(polar(r, to))}`
}

function head(tip, direction, size = 9) {
  const [x, y] = tip, [u, v] = direction
  const point = (a, b) => `${(x - a * u - b * v).toFixed(1)},${(y - a * v + b * u).toFixed(1)}`
  return `M${point(0, 0)}L${point(size, size * 0.42)}L${point(size, -size * 0.42)}Z`
}

// The largest of 1, 2, 5, 10, ... not above x.
function roundDown(x) {
  if (!(x > 0) || !isFinite(x)) return 1
  const power = 10 ** Math.floor(Math.log10(x))
  return power * [5, 2, 1].find((m) => m * power <= x * (1 + 1e-9))
}

// A value with digits that suit its scale.
function said(x, unit, scale = Math.abs(x)) {
  if (!isFinite(x)) return ""
  if (!(scale > 0) || Math.abs(x) < 1e-6 * scale) x = 0
  const extreme = Math.abs(x) >= 1e5 || (scale > 0 && scale < 0.01)
  const text = extreme && x ? x.toExponential(1) : x.toFixed(scale >= 100 ? 0 : scale >= 1 ? 1 : 2)
  return `${text.replace("-", "−")} ${unit}`
}

// ---- Schematics by name, as the class of a brake states it. Each gives the place of the rotor,
// what is fixed, what is pressed, where the actuation force acts and in which direction, where the
// contact is, and how it opens.

const BRAKES = {
  wedge({angle = 0.34}) {
    const slope = Math.tan(angle)
    const half = clamp(76 / slope / 2, 26, 62)
    const thin = 17, thick = Math.min(thin + 2 * half * slope, 88)
    const steep = (thick - thin) / (2 * half)
    const base = (x) => -Math.sqrt((R + 1) ** 2 - x * x)
    const top = (x) => base(half) - thin - (half - x) * steep
    const across = [steep, -1].map((c) => c / Math.hypot(steep, 1))
    const shift = (x, far) => [x + far * across[0], top(x) + far * across[1]]
    const face = [shift(-half - 16, 10), shift(half + 20, 10)]
    const back = [shift(half + 20, 22), shift(-half - 16, 22)]
    const rollers = [-0.62, 0, 0.62].map((s) => shift(s * half, 5))
    const dx = Math.min(5 / steep, 12)
    return {
      centre: [150, clamp(46 - top(-half), 190, 238)],
      fixed: ground(face, back),
      pressed: `<path class="body brake" d="M${xy([-half, base(half)])}`
        + `L${xy([-half, top(-half)])}L${xy([half, top(half)])}L${xy([half, base(half)])}`
        + `A${R + 1},${R + 1} 0 0 0 ${xy([-half, base(half)])}Z"/>`
        + rollers.map((p) => `<circle class="roller" cx="${p[0]}" cy="${p[1]}" r="5"/>`).join("")
        + `<text class="note" x="${-half + 6}" y="${(top(-half) + base(half)) / 2 + 11}"`
        + ` text-anchor="start">α = ${(angle * 180 / Math.PI).toFixed(1)}°</text>`,
      force: {at: [-half, top(-half) / 2 + base(half) / 2], direction: [1, 0]},
      contact: [-half / R, half / R],
      opened: `translate(${-dx},${-dx * steep})`,
    }
  },

  conventional() {
    const half = 56, base = -Math.sqrt((R + 1) ** 2 - half * half), top = -R - 34
    const guide = (side) => ground(
      [[side * (half + 4), top - 16], [side * (half + 4), base - 6]],
      [[side * (half + 15), base - 6], [side * (half + 15), top - 16]])
    return {
      centre: [150, 226],
      fixed: guide(-1) + guide(1),
      pressed: `<path class="body brake" d="M${xy([-half, base])}L${xy([-half, top])}`
        + `L${xy([half, top])}L${xy([half, base])}A${R + 1},${R + 1} 0 0 0 ${xy([-half, base])}Z"/>`,
      force: {at: [0, top], direction: [0, 1]},
      contact: [-half / R, half / R],
      opened: "translate(0,-6)",
    }
  },

  band({wrap_angle: wrap = 4}) {
    const half = Math.min(wrap, 5.2) / 2, r = R + 4
    const [left, right] = [polar(r, -half), polar(r, half)]
    // Away from the drum along the band's ends.
    const out = [[-Math.cos(half), Math.sin(half)], [Math.cos(half), Math.sin(half)]]
    const anchor = [left[0] + 26 * out[0][0], left[1] + 26 * out[0][1]]
    const pulled = [right[0] + 14 * out[1][0], right[1] + 14 * out[1][1]]
    const n = [-out[0][1], out[0][0]]
    const side = (k, far) => [anchor[0] + k * n[0] + far * out[0][0],
      anchor[1] + k * n[1] + far * out[0][1]]
    return {
      centre: [150, 146],
      fixed: ground([side(-13, 0), side(13, 0)], [side(13, 10), side(-13, 10)])
        + `<circle class="roller" cx="${anchor[0]}" cy="${anchor[1]}" r="3.5"/>`,
      pressed: `<path d="${arc(r, -half, half)}" fill="none" stroke="#1B2430" stroke-width="7"/>`
        + `<path d="${arc(r, -half, half)}" fill="none" stroke="#F6E3CF" stroke-width="4.4"/>`
        + `<path class="fine" style="stroke-width:2.4" d="M${xy(left)}L${xy(anchor)}`
        + `M${xy(right)}L${xy(pulled)}"/>`
        + `<text class="note" x="0" y="${-r - 9}" text-anchor="middle">`
        + `wrap angle ${wrap.toFixed(2)} rad</text>`,
      force: {at: pulled, direction: out[1], pulls: true},
      contact: [-half, half],
      opened: "scale(1.045)",
    }
  },

  "leading-shoe"({actuation_arm: a = 0.2, normal_arm: b = 0.1, friction_arm: d = 0.08}) {
    const scale = Math.min(160 / a, 96 / b, 62 / Math.max(d, 1e-9))
    const pivot = [b * scale, -R - 2 - Math.max(d * scale, 12)]
    const end = pivot[0] - a * scale, half = 32
    const base = -Math.sqrt((R + 1) ** 2 - half * half)
    const far = Math.min(end, -half), y = pivot[1]
    return {
      centre: [150, 232],
      fixed: ground([[pivot[0] - 13, y - 20], [pivot[0] + 13, y - 20]],
        [[pivot[0] + 13, y - 29], [pivot[0] - 13, y - 29]])
        + `<path class="fine" d="M${pivot[0]},${y}L${pivot[0] - 8},${y - 20}`
        + `M${pivot[0]},${y}L${pivot[0] + 8},${y - 20}"/>`,
      pressed: `<path class="body brake" d="M${xy([far - 8, y - 7])}L${xy([pivot[0] + 9, y - 7])}`
        + `L${xy([pivot[0] + 9, y + 7])}L${xy([Math.max(half, far), y + 7])}`
        + `L${xy([half, base])}A${R + 1},${R + 1} 0 0 0 ${xy([-half, base])}`
        + `L${xy([-half, y + 7])}L${xy([far - 8, y + 7])}Z"/>`
        + `<circle class="roller" cx="${pivot[0]}" cy="${y}" r="4"/>`,
      force: {at: [end, y - 7], direction: [0, 1]},
      contact: [-half / R, half / R],
      opened: `rotate(3.2,${pivot[0]},${y})`,
    }
  },
}

// A brake without a drawing of its own: a plain block, and its name.
function unknown(shape, name) {
  const half = 62, base = -Math.sqrt((R + 1) ** 2 - half * half), top = -R - 48
  const words = name.replace(/[^\w -]/g, "")
  return {
    centre: [150, 226], fixed: "",
    pressed: `<path class="body" fill="#E9EDF1" stroke-dasharray="5 3" d="M${xy([-half, base])}`
      + `L${xy([-half, top])}L${xy([half, top])}L${xy([half, base])}`
      + `A${R + 1},${R + 1} 0 0 0 ${xy([-half, base])}Z"/>`
      + `<text x="0" y="${top + 18}" text-anchor="middle">${words}</text>`
      + `<text class="note" x="0" y="${top + 34}" text-anchor="middle">(no drawing)</text>`,
    force: {at: [0, top], direction: [0, 1]}, contact: [-half / R, half / R], opened: "translate(0,-6)",
  }
}

// A hatched fixed body: its edge and the area behind it.
function ground(edge, back) {
  return `<path class="hatched" d="M${[...edge, ...back].map(xy).join("L")}Z"/>`
    + `<path class="edge" d="M${edge.map(xy).join("L")}"/>`
}

// Small drawing of the wall, torsion spring, damper and inertia.
function driveline() {
  const zigzag = Array.from({length: 9}, (_, i) => `${24 + 3.4 * i},${i % 2 ? 3 : 13}`).join("L")
  return `<g transform="translate(4,348)">`
    + ground([[6, 0], [6, 36]], [[0, 36], [0, 0]])
    + `<path class="fine" d="M6,8L20,8L${zigzag}L56,8L64,8M6,28L34,28M48,22.5L34,22.5L34,33.5L48,33.5`
    + `M41,24L41,32M41,28L64,28M64,8L64,28M64,18L74,18"/>`
    + `<rect class="body rotor" x="74" y="3" width="11" height="30"/>`
    + `<text class="symbol" x="36" y="-1" text-anchor="middle">k</text>`
    + `<text class="symbol" x="22" y="42">c</text><text class="symbol" x="79.5" y="-1" text-anchor="middle">J</text></g>`
}

// The sketch of a machine (figures/data/sketch.py) with its bodies, and below it a line of words for
// each of some contacts. Words are shortened to the width that the sketch has for them.
function sketched({sketch, discs, contacts}) {
  const {box: [left, bottom, right, top], radius} = sketch, rows = Math.min(contacts.length, MOST_ROWS)
  const scale = clamp(292 / (right - left), LEAST_SCALE, 118), tall = scale * (top - bottom)
  const height = tall + 14 + 16 * rows, width = Math.max(scale * (right - left) + 8, 300)
  const at = ([x, y]) => [width / 2 + scale * (x - (left + right) / 2), 6 + scale * (top - y)]
  const written = (words, place, width, kind = "") => {
    const most = Math.max(Math.floor(width * scale / 5.6), 1)
    const text = words.length > most ? `${words.slice(0, most - 1)}…` : words
    const [x, y] = at(place)
    return `<text class="name ${kind}" x="${x.toFixed(1)}" y="${(y + 4).toFixed(1)}">${text}<title>${words}</title></text>`
  }
  const lines = sketch.lines.map(({part, points, look}) => {
    const which = look === "bold" ? contacts.findIndex((one) => one.name === part) : -1
    return `<path class="sketch-${look.replace(" ", "-")} ${which < 0 ? "" : `contact-${which}`}" d="M${points.map((one) => xy(at(one))).join("L")}"/>`
  })
  const r = scale * radius
  const bodies = discs.map((one, i) => `<g transform="translate(${xy(at(one.at))})">`
    + `<circle class="body ${one.driven ? "brake" : "rotor"}" r="${r.toFixed(1)}"/>`
    + (one.driven ? `<circle class="fine" r="${(0.86 * r).toFixed(1)}"/>` : "")
    + `<g class="disc-${i}"><path class="pointer" d="M0,${(-r + 2).toFixed(1)}L0,${(-0.7 * r).toFixed(1)}"/></g>`
    + `<text class="name symbolic speed-${i}" y="12"></text></g>`
    + written(one.name, [one.at[0], one.at[1] + 5 / scale], 3.4 * radius, "symbolic"))
  const names = sketch.texts.map((one) => written(one.words, one.at, one.wide))
  const words = contacts.slice(0, rows).map((_, i) =>
    `<text class="words-${i}" x="10" y="${(height - 6 - 16 * (rows - 1 - i)).toFixed(1)}"></text>`)
  const drawing = [...lines, ...bodies, ...names, ...words].join("")
  return {drawing, width, height, unit: r > 27 ? "rad/s" : ""}
}

function rotor() {
  const marks = Array.from({length: 12}, (_, i) => {
    const a = i * Math.PI / 6
    return i ? `M${xy(polar(R - 9, a))}L${xy(polar(R - 1, a))}` : ""
  }).join("")
  return `<circle class="body rotor" r="${R}"/><g class="turning">`
    + `<path class="mark" d="${marks}"/>`
    + `<circle r="${(R * 0.56).toFixed(1)}" class="mark"/>`
    + `<path class="pointer" d="M0,${-R + 2}L0,${-R + 16}"/>`
    + [60, 180, 300].map((a) => `<circle class="roller" r="4.5" transform="rotate(${a}) translate(0,-36)"/>`).join("")
    + `<path class="fine" d="M0,-12L0,12M-12,0L12,0"/></g>`
    + `<circle r="4" fill="#1B2430"/>`
}

export function render({model, el, view}) {
  const page = document.createElement("div")
  page.className = "stage"
  page.innerHTML = `
    <div class="top"><h2>Brake</h2><span class="word" data-testid="stage-state" aria-live="off"></span>
      <button type="button" class="whole" data-testid="whole" title="Show the drawing on the whole screen"
        aria-label="whole screen"><svg viewBox="0 0 12 12"><path d="M1,4V1H4M8,1H11V4M11,8V11H8M4,11H1V8"/></svg></button></div>
    <svg class="drawing" viewBox="0 0 300 392" role="img" data-testid="stage-svg"
         aria-label="The brake at one instant of its motion"></svg>
    <div class="transport">
      <button type="button" class="play" data-testid="play" title="Play or pause the motion" aria-label="play"></button>
      <input type="range" min="0" max="1" step="any" data-testid="scrub" aria-label="instant of the motion"
             title="Instant of the motion; a click in the history moves it too">
      <select aria-label="speed of the motion" title="Speed of the animation relative to real time"
              data-testid="stage-speed"></select>
    </div>
    <div class="foot"><span data-testid="stage-time"></span><span class="scale"></span></div>`
  const find = (name) => page.querySelector(name)
  const title = find("h2")
  const [svg, word, play, scrub, speed] =
    ["svg.drawing", ".word", ".play", "[data-testid=scrub]", "select"].map(find)
  const [clock, scaleNote] = ["[data-testid=stage-time]", ".scale"].map(find)

  const named = (name) => view.model.document?.get_model_by_name(name) ?? null
  const motion = named("motion"), pointed = named("scrub-to")
  const cursors = [["scrub-history", (s, time) => [time, s.velocity]],
    ["scrub-phase", (s) => [s.angle, s.velocity]],
    ["scrub-torque", (s) => [s.sliding, s.torque]]]
    .map(([name, place]) => [named(name), place]).filter(([source]) => source)

  let samples = {time: [], angle: [], velocity: [], torque: [], drive: [], force: [], sliding: [], sticking: []}
  let scales = null, parts = null, drawn = "", share = null, playing = false, last = 0
  let frame = 0, wanted = 0

  let state = model.state ?? {}   // read once: access through the model is slow

  function measure() {
    const {drive_speed = 0, frequency = 1, amplitude = 0} = state
    let low = Infinity, high = -Infinity, fast = 0, torque = 0, press = 0
    for (let i = 0; i < samples.time.length; i++) {
      const v = samples.velocity[i] + drive_speed
      low = Math.min(low, samples.angle[i]); high = Math.max(high, samples.angle[i])
      fast = Math.max(fast, Math.abs(v))
      torque = Math.max(torque, Math.abs(samples.torque[i]))
      press = Math.max(press, Math.abs(samples.force[i]))
    }
    if (state.discs) {
      // Bodies that turn are slowed down, in the same ratio.
      const t = state.times
      for (const {angle: a} of state.discs) {
        for (let i = 1; i < t.length; i++) {
          if (t[i] > t[i - 1]) fast = Math.max(fast, Math.abs((a[i] - a[i - 1]) / (t[i] - t[i - 1])))
        }
      }
      low = 0; high = 0
    }
    const angle = Math.min(MOST, 2 * SWING / (high - low), FASTEST * SECONDS * frequency / fast)
    scales = {angle: roundDown(angle), speed: fast, force: press, torque: Math.max(torque, amplitude)}
    scaleNote.textContent = isFinite(angle) && fast > 0 ? `turn magnified × ${scales.angle.toLocaleString("en")}` : ""
  }

  function draw() {
    const {schematic = "", name = "", shape = {}, discs, contacts, sketch} = state
    const wish = JSON.stringify([schematic, name, shape, sketch])
    if (wish === drawn) return
    drawn = wish
    title.textContent = discs ? "Machine" : "Brake"
    if (discs) {
      const {drawing, width, height, unit} = sketched(state)
      svg.innerHTML = drawing
      svg.setAttribute("viewBox", `0 0 ${width.toFixed(0)} ${height.toFixed(0)}`)
      const found = (name, all) => all.map((_, i) => svg.querySelectorAll(`.${name}-${i}`))
      parts = {unit, discs: found("disc", discs), speeds: found("speed", discs),
        lines: found("contact", contacts), words: found("words", contacts)}
      for (const name of ["discs", "speeds", "words"]) parts[name] = parts[name].map(([one]) => one)
      return
    }
    const brake = (BRAKES[schematic] ?? unknown)(shape, name)
    svg.setAttribute("viewBox", "0 0 300 392")
    svg.innerHTML = `${HATCH}
      <g transform="translate(${brake.centre})">
        ${rotor()}${brake.fixed}<g class="pressed">${brake.pressed}</g>
        <path class="contact"/>
        <path class="arrow torque"/><path class="head torque-head"/>
        <path class="arrow drive" stroke="#5B6675"/><path class="head drive-head" fill="#5B6675"/>
        <path class="arrow push" stroke="#1B2430"/><path class="head push-head" fill="#1B2430"/>
        <text class="push-text"></text>
      </g>
      <g>${driveline()}
        <text x="292" y="372" text-anchor="end" class="friction-text"></text>
        <text x="292" y="387" text-anchor="end" class="drive-text"></text></g>`
    parts = {brake}
    for (const name of ["turning", "pressed", "contact", "torque", "torque-head", "drive",
      "drive-head", "push", "push-head", "push-text", "friction-text", "drive-text"]) {
      parts[name] = svg.querySelector(`.${name}`)
    }
    parts.contact.setAttribute("d", arc(R - 1, ...brake.contact))
  }

  // The state at a time [s], between the samples.
  function at(time) {
    const t = samples.time
    let low = 0, high = t.length - 1
    while (high - low > 1) {
      const middle = (low + high) >> 1
      if (t[middle] <= time) low = middle
      else high = middle
    }
    const x = clamp((time - t[low]) / (t[high] - t[low] || 1), 0, 1)
    const mix = (name) => (1 - x) * samples[name][low] + x * samples[name][high]
    return {angle: mix("angle"), velocity: mix("velocity"), torque: mix("torque"),
      drive: mix("drive"), force: mix("force"), sliding: mix("sliding"), sticking: samples.sticking[x < 0.5 ? low : high] > 0}
  }

  function now() {
    const t = samples.time, n = t.length
    return n ? t[0] + share * (t[n - 1] - t[0]) : NaN
  }

  // One picture: the cursors in the charts at once, the drawing with the next frame, after
  // Bokeh has painted: it reads styles, which is slow where the page has just changed.
  function paint() {
    const time = now(), s = isFinite(time) ? at(time) : null
    for (const [source, place] of cursors) {
      const [x, y] = s ? place(s, time).map(one => [one]) : [[], []]
      source.setv({data: {x, y}}, {sync: false})
    }
    if (!wanted) wanted = requestAnimationFrame(paintDrawing)
  }

  function paintDrawing() {
    wanted = 0
    draw()
    const time = now(), {drive_speed = 0, frequency = 1} = state
    if (!isFinite(time)) {
      word.textContent = ""
      clock.textContent = "no motion"
      return
    }
    const s = at(time), v = s.sliding, press = s.force
    const released = !s.sticking && press === 0
    const state_ = s.sticking ? "sticking" : released ? "released" : "sliding"
    const colour = COLOURS[state_]
    word.textContent = state_ !== "sliding" ? state_ : v >= 0 ? "sliding forwards" : "sliding backwards"
    word.className = `word ${state_}`
    if (state.discs && !state.contacts.length) word.textContent = ""
    clock.textContent = `t = ${time.toFixed(frequency < 1 ? 2 : 4)} s`
    scrub.setAttribute("aria-valuetext", clock.textContent)
    if (state.discs) {
      paintBodies(time)
      return
    }
    const turn = scales.angle * (s.angle + drive_speed * (time - samples.time[0]))
    parts.turning.setAttribute("transform", `rotate(${(turn * 180 / Math.PI % 360).toFixed(2)})`)
    parts.pressed.setAttribute("transform", released ? parts.brake.opened : "")
    parts.contact.setAttribute("stroke", released ? "none" : colour)
    paintForce(press)
    bend("torque", -s.torque / (scales.torque || 1) * WIDEST, R - 17, colour)
    parts["friction-text"].textContent = `brake torque ${said(s.torque, "N m", scales.torque)}`
    parts["friction-text"].style.fill = colour
    bend("drive", s.drive / (scales.torque || 1) * WIDEST * 1.6, 24)
    parts["drive-text"].textContent = `drive torque ${said(s.drive, "N m", scales.torque)}`
  }

  function paintBodies(time) {
    const t = state.times
    let low = 0, high = t.length - 1
    while (high - low > 1) {
      const middle = (low + high) >> 1
      if (t[middle] <= time) low = middle
      else high = middle
    }
    const span = t[high] - t[low] || 1, x = clamp((time - t[low]) / span, 0, 1)
    state.discs.forEach(({angle}, i) => {
      const turn = scales.angle * ((1 - x) * angle[low] + x * angle[high])
      parts.discs[i].setAttribute("transform", `rotate(${(turn * 180 / Math.PI % 360).toFixed(2)})`)
      const speed = (angle[high] - angle[low]) / span, seen = Math.abs(speed) > 1e-6 * scales.speed
      parts.speeds[i].textContent = said(seen ? speed : 0, parts.unit)
    })
    state.contacts.forEach(({name, sticking, torque}, i) => {
      const stuck = sticking[x < 0.5 ? low : high] > 0, colour = COLOURS[stuck ? "sticking" : "sliding"]
      parts.lines[i].forEach((one) => one.style.stroke = colour)
      if (!parts.words[i]) return
      parts.words[i].style.fill = colour
      parts.words[i].textContent = `${name} ${stuck ? "sticks" : "slides"}, `
        + said((1 - x) * torque[low] + x * torque[high], "N m", Math.max(...torque.map(Math.abs)))
    })
  }

  function paintForce(press) {
    const {at: [x, y], direction: [u, v], pulls} = parts.brake.force
    const length = clamp(press / (scales.force || 1), -1, 1) * LONGEST
    const seen = Math.abs(length) > 1.5
    // A pull begins at the brake, a push ends there.
    const [from, to] = pulls ? [0, length + 8] : [-length - 8, 0]
    const [start, tip] = length >= 0 ? [from, to] : [to - 8, from + 8 + length]
    const sign = length >= 0 ? 1 : -1
    const place = (s) => [x + s * u, y + s * v]
    parts.push.setAttribute("d", seen ? `M${xy(place(start))}L${xy(place(tip - sign * 7))}` : "")
    parts["push-head"].setAttribute("d", seen ? head(place(tip), [sign * u, sign * v]) : "")
    const text = parts["push-text"], upright = Math.abs(v) > 0.5
    text.textContent = `Fₐ ${said(press, "N", scales.force)}`
    const far = pulls ? 46 : -LONGEST + 10
    let [tx, ty] = upright ? [x + far * u + 10, y + far * v] : [x - LONGEST - 8, y - 9]
    const right = parts.brake.centre[0] + tx > 225
    if (right) [tx, ty] = [290 - parts.brake.centre[0], ty + (pulls ? 26 : 0)]
    text.setAttribute("x", tx)
    text.setAttribute("y", ty)
    text.setAttribute("text-anchor", right ? "end" : "start")
  }

  // An arrow along a circle about the shaft, from the top.
  function bend(name, angle, r, colour) {
    const line = parts[name], tip = parts[`${name}-head`], seen = Math.abs(angle) > 0.03
    const sign = Math.sign(angle), body = angle - sign * Math.min(7 / r, Math.abs(angle))
    line.setAttribute("d", seen ? arc(r, 0, body) : "")
    tip.setAttribute("d", seen ? head(polar(r, angle), [sign * Math.cos(angle - sign * 4 / r), sign * Math.sin(angle - sign * 4 / r)]) : "")
    if (colour) { line.setAttribute("stroke", colour); tip.setAttribute("fill", colour) }
  }

  function loaded() {
    if (!motion) return
    samples = motion.data
    const n = samples.time.length
    if (n && share === null) {
      const {first} = state
      const t = samples.time
      share = first == null ? 0.5 : clamp((first - t[0]) / (t[n - 1] - t[0] || 1), 0, 1)
      scrub.value = share
    }
    for (const control of [play, scrub, speed]) control.disabled = n === 0
    scrub.max = 1
    measure()
    paint()
  }

  function listSpeeds() {
    const {frequency = 1} = state
    const chosen = speed.value || "1"
    speed.innerHTML = SPEEDS.map((s) => {
      const slower = SECONDS * frequency / s
      const times = Number(Math.max(slower, 1 / slower).toPrecision(2)).toLocaleString("en")
      const words = times === "1" ? "real time" : `${times}× ${slower >= 1 ? "slower" : "faster"}`
      return `<option value="${s}">${words}</option>`
    }).join("")
    speed.value = chosen
  }

  function go(to) {
    share = clamp(to, 0, 1)
    scrub.value = share
    paint()
  }

  function step(stamp) {
    if (!playing || !page.isConnected) return
    frame = requestAnimationFrame(step)
    const calm = matchMedia("(prefers-reduced-motion: reduce)").matches
    const passed = stamp - last
    if (passed < (calm ? FRAME_CALM : FRAME) - 4) return
    last = stamp
    const t = samples.time, n = t.length
    if (n < 2) return
    const {frequency = 1} = state
    // After a pause of the browser the motion continues from the same instant.
    const seconds = Math.min(passed, 300) / 1000 * Number(speed.value) / (SECONDS * frequency)
    go((share + seconds / (t[n - 1] - t[0])) % 1)
  }

  function setPlaying(on) {
    playing = on
    play.setAttribute("aria-label", on ? "pause" : "play")
    play.setAttribute("aria-pressed", String(on))
    play.innerHTML = on ? `<svg viewBox="0 0 12 12"><path d="M2,1h3v10h-3zM7,1h3v10h-3z"/></svg>`
      : `<svg viewBox="0 0 12 12"><path d="M2,1L11,6L2,11Z"/></svg>`
    cancelAnimationFrame(frame)
    if (on) { last = performance.now(); frame = requestAnimationFrame(step) }
  }

  play.addEventListener("click", () => setPlaying(!playing))
  const whole = find(".whole")
  whole.hidden = !document.fullscreenEnabled
  whole.addEventListener("click", () => {
    if (document.fullscreenElement) document.exitFullscreen()
    else page.requestFullscreen()
  })
  scrub.addEventListener("input", () => go(Number(scrub.value)))
  const toPointed = () => {
    const t = samples.time, n = t.length, x = pointed.data.x[0]
    if (n > 1 && isFinite(x)) go((x - t[0]) / (t[n - 1] - t[0]))
  }
  const changed = () => { state = model.state ?? {}; listSpeeds(); loaded() }

  motion?.properties.data.change.connect(loaded)
  pointed?.properties.data.change.connect(toPointed)
  model.on("state", changed)
  model.on("remove", () => {
    setPlaying(false)
    motion?.properties.data.change.disconnect(loaded)
    pointed?.properties.data.change.disconnect(toPointed)
  })
  setPlaying(false)
  el.append(page)
  changed()
}
