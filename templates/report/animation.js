// Films of the runs: unpacks what sandmould/report/animation.py packed, and draws it.
{
  const byId = (id) => document.getElementById(id);
  const canvas = byId("film-canvas"), slider = byId("film-slider"), play = byId("film-play");
  const time = byId("film-time"), choice = byId("film-run"), cut = byId("film-cut");
  const scene = JSON.parse(byId("film-scene").textContent);
  const measure = JSON.parse(byId("film-measure").textContent);
  const stored = [...document.querySelectorAll("script.film")];
  const ABSENT = 65535, FRAMES_PER_S = 20, MARGIN_PX = 8;
  let film = null;

  async function unpack(packed) {
    const raw = await inflate(packed.data);
    const n = packed.grains, frames = packed.time_s.length, d = packed.dimension;
    const at = unfold(raw, d, frames, n), start = 2 * d * frames * n;
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
    const width = canvas.clientWidth, ratio = window.devicePixelRatio || 1;
    const scale = (width - 2 * MARGIN_PX) / scene.width_m;
    const height = scale * scene.height_m + 2 * MARGIN_PX;
    canvas.style.height = `${height}px`;
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    const pen = canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.fillStyle = "#fff";
    pen.fillRect(0, 0, width, height);
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

  // far grains first, near ones over them; cut open, the tube hides what lies behind it
  function drawSpheres(v, frame) {
    const [x, y, z] = [0, 1, 2].map((axis) => film.at(axis, frame));
    const metres = (axis, value) => film.origin_m[axis] + film.quantum_m * value;
    const inside = (i) => scene.tubes.some((t) => metres(0, x[i]) > t.x_m[0] && metres(0, x[i]) < t.x_m[1]
      && Math.hypot(metres(1, y[i]) - t.axis_m[0], metres(2, z[i]) - t.axis_m[1]) < t.radius_m);
    const order = [];
    for (let i = 0; i < film.grains; i++) {
      if (x[i] !== ABSENT && !(cut.checked && metres(1, y[i]) < scene.cut_m)) order.push(i);
    }
    order.sort((a, b) => y[b] - y[a]);
    const drawGrain = (i) => {
      v.pen.beginPath();
      v.pen.arc(v.x(metres(0, x[i])), v.y(metres(2, z[i])), v.scale * film.radius_m[i], 0, 2 * Math.PI);
      v.pen.fillStyle = colour(film.layer[i]);
      v.pen.fill();
      v.pen.lineWidth = 0.6;
      v.pen.strokeStyle = "#0008";
      v.pen.stroke();
    };
    if (!cut.checked) {
      drawScene(v, frame);
      order.forEach(drawGrain);
      return;
    }
    order.filter((i) => !inside(i)).forEach(drawGrain);
    v.pen.fillStyle = "#eeeeee";
    for (const bore of scene.bores) { trace(v, bore); v.pen.closePath(); v.pen.fill(); }
    drawScene(v, frame);
    order.filter(inside).forEach(drawGrain);
  }

  function draw(shown, frame) {
    if (film !== shown) phases(shown);
    film = shown;
    const v = view();
    if (film.dimension === 2) {
      drawDiscs(v, film.at(0, frame), film.at(1, frame));
      drawScene(v, frame);
    } else {
      drawSpheres(v, frame);
    }
    const shaken = film.vibration_time_s[frame], value = film.reading[frame];
    const total = film.vibration_time_s[film.frames - 1];
    const clock = shaken < 0 ? `filling, ${film.time_s[frame].toFixed(2)} s`
      : atRest(film.stage[frame]) ? `rest, ${film.time_s[frame].toFixed(2)} s`
      : `vibration, ${shaken.toFixed(2)} of ${total.toFixed(2)} s`;
    time.textContent = value === null ? clock : `${clock} · ${measure} ${value.toFixed(3)}`;
    slider.setAttribute("aria-valuetext", clock);
  }

  const atRest = (stage) => stage.split("_")[0] === "rest";

  function phases(film) {
    const filling = film.vibration_time_s.filter((t) => t < 0).length;
    // rests between two vibrations are short and belong to them
    const rest = [...film.stage].reverse().findIndex((stage) => !atRest(stage));
    const vibration = film.frames - filling - rest;
    byId("film-phases").innerHTML = "";
    for (const [name, frames] of [["filling", filling], ["vibration", vibration], ["rest", rest]]) {
      if (!frames) continue;
      const part = document.createElement("span");
      part.textContent = name;
      part.style.flexGrow = frames;
      part.style.flexBasis = 0;
      if (name === "vibration") part.className = "shaken";
      byId("film-phases").append(part);
    }
  }

  // another run is shown at the moment nearest to the one before
  function frameFor(next, before, frame) {
    // vibration time is below zero all the while the box is filled
    const moment = (it, n) => (it.vibration_time_s[n] < 0 ? it.time_s[n] - 1e6 : it.vibration_time_s[n]);
    if (!before) return Math.max(next.time_s.findIndex((_, n) => next.vibration_time_s[n] >= 0), 0);
    const gaps = next.time_s.map((_, n) => Math.abs(moment(next, n) - moment(before, frame)));
    return gaps.indexOf(Math.min(...gaps));
  }

  const redraw = playFilms({
    page: { slider, play, choice, time, canvas }, stored, framesPerS: FRAMES_PER_S, unpack, draw, frameFor,
  });
  if (cut) cut.addEventListener("change", redraw);
}
