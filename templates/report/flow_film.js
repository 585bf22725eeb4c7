// Films of metal: unpacks what sandmould/drawing/flow_film.py packed, and draws it.
{
  const byId = (id) => document.getElementById(id);
  const canvas = byId("flow-canvas"), slider = byId("flow-slider"), play = byId("flow-play");
  const time = byId("flow-time"), choice = byId("flow-run"), shown = byId("flow-colour");
  const stored = [...document.querySelectorAll("script.flow-film")];
  const scale = JSON.parse(byId("flow-scale").textContent);
  const ABSENT = 65535, FRAMES_PER_S = 15;

  async function unpack(packed) {
    const raw = await inflate(packed.data);
    const n = packed.particles, frames = packed.time_s.length, d = packed.dimension;
    const at = unfold(raw, d, frames, n), start = 2 * d * frames * n;
    const shade = (kind, frame) => raw.subarray(start + (kind * frames + frame) * n);
    return { ...packed, data: null, frames, at, shade };
  }

  function draw(film, frame) {
    const up = film.dimension - 1;
    const wide_m = film.high_m[0] - film.low_m[0], high_m = film.high_m[up] - film.low_m[up];
    const { pen, scale: pxPerM, height } = fittedPen(canvas, wide_m, high_m, 0);
    const r = 0.5 * pxPerM * film.particle_m;
    const disc = (x, y, colour) => {
      pen.fillStyle = colour;
      pen.beginPath();
      pen.arc(x, height - y, r, 0, 2 * Math.PI);
      pen.fill();
    };
    for (const [x, y] of film.wall_m) disc(pxPerM * (x - film.low_m[0]), pxPerM * (y - film.low_m[up]), "#bbb");
    const px = pxPerM * film.quantum_m, x = film.at(0, frame), y = film.at(up, frame);
    const kind = shown.value === "pressure" ? 0 : 1, shade = film.shade(kind, frame);
    const order = [];
    const depth = up === 2 ? film.at(1, frame) : null;
    // cut open in the middle, far particles first
    for (let i = 0; i < film.particles; i++) {
      if (x[i] === ABSENT) continue;
      if (depth && film.low_m[1] + film.quantum_m * depth[i] < 0) continue;
      order.push(i);
    }
    if (depth) order.sort((a, b) => depth[b] - depth[a]);
    for (const i of order) disc(px * x[i], px * y[i], scale.colours[shade[i]]);
    const most = kind === 0 ? `${film.highest_pa.toFixed(0)} Pa` : `${film.highest_m_s.toPrecision(2)} m/s`;
    byId("flow-most").textContent = most;
    time.textContent = `${film.time_s[frame].toFixed(3)} s`;
    slider.setAttribute("aria-valuetext", time.textContent);
  }

  const { redraw } = playFilms({
    page: { slider, play, choice, time, canvas }, stored, framesPerS: FRAMES_PER_S, unpack, draw,
    frameFor: (next, before, frame) =>
      next.time_s.filter((t) => t <= (before ? before.time_s[frame] : Infinity)).length - 1,
  });
  shown.addEventListener("change", redraw);
}
