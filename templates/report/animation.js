// Films of the runs: unpacks what sandmould/drawing/animation.py packed, and draws it.
{
  const byId = (id) => document.getElementById(id);
  const canvas = byId("film-canvas"), slider = byId("film-slider"), play = byId("film-play");
  const time = byId("film-time"), choice = byId("film-run");
  const scene = JSON.parse(byId("film-scene").textContent);
  const measure = JSON.parse(byId("film-measure").textContent);
  const stored = [...document.querySelectorAll("script.film")];
  const ABSENT = 65535, FRAMES_PER_S = 20, MARGIN_PX = 8;
  let film = null;

  async function unpack(packed) {
    const raw = await inflate(packed.data);
    const n = packed.grains, frames = packed.time_s.length;
    const at = unfold(raw, 2, frames, n), start = 4 * frames * n;
    const radius_m = new Float64Array(n);
    for (let grain = 0; grain < n; grain++) {
      const share = raw[start + grain] | (raw[start + n + grain] << 8);
      radius_m[grain] = (share / 65535) * packed.largest_radius_m;
    }
    const layer = raw.subarray(start + 2 * n, start + 3 * n);
    return { ...packed, data: null, frames, at, radius_m, layer };
  }

  // px per m and the turned-over vertical of the canvas
  function view() {
    const { pen, scale, height } = fittedPen(canvas, scene.width_m, scene.height_m, MARGIN_PX);
    return { pen, scale, x: (m) => MARGIN_PX + scale * m, y: (m) => height - MARGIN_PX - scale * m };
  }

  function trace(v, points) {
    v.pen.beginPath();
    points.forEach(([x, y], i) => (i ? v.pen.lineTo(v.x(x), v.y(y)) : v.pen.moveTo(v.x(x), v.y(y))));
  }

  // vertices of a bent pattern, in m
  function outline(flat) {
    const points = [];
    for (let i = 0; i < flat.length; i += 2) points.push([scene.bent_m * flat[i], scene.bent_m * flat[i + 1]]);
    return points;
  }

  function drawScene(v, frame) {
    v.pen.lineWidth = 1.2;
    v.pen.strokeStyle = "#404040";
    v.pen.fillStyle = "#cccccc";
    const bent = film.bent.length ? [outline(film.bent[frame])] : [];
    for (const solid of [...scene.solids, ...bent]) { trace(v, solid); v.pen.closePath(); v.pen.fill(); v.pen.stroke(); }
    v.pen.lineWidth = 2;
    for (const wall of scene.walls) { trace(v, wall); v.pen.stroke(); }
    v.pen.lineWidth = 1;
    v.pen.setLineDash([5, 4]);
    for (const space of [...scene.bores, ...scene.cavities]) { trace(v, space); v.pen.closePath(); v.pen.stroke(); }
    v.pen.setLineDash([]);
  }

  const colour = (layer) => scene.layer_colours[(layer - 1) % scene.layer_colours.length];

  function drawDiscs(v, x, y) {
    const path = new Map();
    for (let i = 0; i < film.grains; i++) {
      if (x[i] === ABSENT) continue;
      const key = film.layer[i];
      if (!path.has(key)) path.set(key, new Path2D());
      const u = v.x(film.origin_m[0] + film.quantum_m * x[i]);
      const w = v.y(film.origin_m[1] + film.quantum_m * y[i]);
      const r = v.scale * film.radius_m[i];
      path.get(key).moveTo(u + r, w);
      path.get(key).arc(u, w, r, 0, 2 * Math.PI);
    }
    v.pen.lineWidth = 0.6;
    v.pen.strokeStyle = "#0008";
    for (const [layer, discs] of path) {
      v.pen.fillStyle = colour(layer);
      v.pen.fill(discs);
      if (v.scale * film.largest_radius_m > 2.5) v.pen.stroke(discs);
    }
  }

  function draw(shown, frame) {
    if (film !== shown) showPhases(shown, byId("film-phases"));
    film = shown;
    const v = view();
    drawDiscs(v, film.at(0, frame), film.at(1, frame));
    drawScene(v, frame);
    tellTime(film, frame, measure, { time, slider });
  }

  playFilms({
    page: { slider, play, choice, time, canvas }, stored, framesPerS: FRAMES_PER_S, unpack, draw,
    frameFor: nearestFrame,
  });
}
