// The 3D view of the page: unpacks what sandmould/drawing/sphere_film.py packed; turn, zoom, cut, colour.
{
  const byId = (id) => document.getElementById(id);
  const canvas = byId("film-canvas"), slider = byId("film-slider"), play = byId("film-play");
  const time = byId("film-time"), choice = byId("film-run"), colour = byId("film-colour");
  const cutAxis = byId("film-cut"), cutPlace = byId("film-cut-place"), sand = byId("film-sand");
  const solids = byId("film-solids"), all = byId("film-all"), surface = byId("film-surface");
  const stored = [...document.querySelectorAll("script.film")];
  const measure = JSON.parse(byId("film-measure").textContent);
  const FRAMES_PER_S = 10, STEP = 0.12;
  const LOOKS = { corner: [0.55, 0.35], front: [0, 0], side: [Math.PI / 2, 0], top: [0, Math.PI / 2] };

  async function unpackScene(scene) {
    for (const solid of scene.solids) {
      const { buffer } = await inflate(solid.data);
      const [v, t, e] = [3 * solid.vertices, 3 * solid.triangles, 2 * solid.edges];
      solid.places = new Float32Array(buffer, 0, v);
      solid.faces = new Uint32Array(buffer, 4 * v, t);
      solid.lines = new Uint32Array(buffer, 4 * (v + t), e);
      const shades = (n) => new Uint8Array(buffer, 4 * (v + t + e) + n * solid.vertices, solid.vertices);
      solid.shades = Array.from({ length: solid.fields }, (_, n) => shades(n));
    }
    return scene;
  }

  async function unpack(packed) {
    const raw = await inflate(packed.data);
    const n = packed.grains, frames = packed.time_s.length, points = n + packed.vertices;
    const radii = 6 * frames * points, shades = radii + 3 * n;
    const size = Uint16Array.from({ length: n }, (_, i) => raw[radii + i] | (raw[radii + n + i] << 8));
    const at = (from) => raw.subarray(from, from + n);
    return {
      ...packed, data: null, frames, size, at: unfold(raw, 3, frames, points), layer: at(radii + 2 * n),
      shade: (kind, frame) => at(shades + (kind * frames + frame) * n),
    };
  }

  function start(scene, view) {
    const [width, depth, height] = scene.size_m;
    const camera = { turn: 0, tilt: 0, zoom: 1, centre: [] };
    let film = null, waiting = false;

    // what the colours are of: a number from 0 to 255 a grain, and both ends of the scale in words
    const COLOURS = {
      layer: { shades: () => film.layer.map((layer) => (layer - 1) % scene.layer_colours.length), rgb: scene.layer_colours },
      density: { shades: (frame) => film.shade(0, frame), ends: () => film.density_kg_m3.map((d) => `${d.toFixed(0)} kg/m³`) },
      speed: { shades: (frame) => film.shade(1, frame), ends: () => ["0", `${film.fastest_m_s.toPrecision(2)} m/s`] },
      size: {
        shades: () => Uint8Array.from(film.size, (share) => Math.round((254 * share) / 65535)),
        ends: () => ["0", `${(2000 * film.largest_radius_m).toPrecision(3)} mm wide`],
      },
    };

    // grains beyond the plane are not drawn: normal and distance from the origin
    function cut() {
      const at = Number(cutPlace.value) / 1000;
      return { none: [0, 0, 1, 1e6], x: [1, 0, 0, at], y: [0, -1, 0, -at], z: [0, 0, 1, at] }[cutAxis.value];
    }

    function setCutAxis(at_m) {
      const axis = "xyz".indexOf(cutAxis.value);
      cutPlace.disabled = axis < 0;
      if (axis >= 0) {
        cutPlace.max = 1000 * scene.size_m[axis];
        cutPlace.value = 1000 * (at_m ?? scene.size_m[axis] / 2);
      }
      tellCut();
    }

    function tellCut() {
      const from = 1000 * (scene.from_m["xyz".indexOf(cutAxis.value)] || 0), at = from + Number(cutPlace.value);
      const text = cutPlace.disabled ? "nothing cut away" : `${cutAxis.value} = ${at.toFixed(1)} mm`;
      byId("film-cut-text").textContent = text;
      cutPlace.setAttribute("aria-valuetext", text);
    }

    function pxPerM() {
      const across = Math.hypot(width, depth), upright = Math.hypot(height, 0.6 * across);
      return (scene.marks ? 0.8 : 0.94) * camera.zoom * Math.min(canvas.clientWidth / across, canvas.clientHeight / upright);
    }

    function tellLook() {
      const degrees = (rad) => Math.round((180 / Math.PI) * rad);
      byId("film-look").textContent =
        `turned ${degrees(camera.turn)}°, tilted ${degrees(camera.tilt)}°, zoom ${camera.zoom.toFixed(1)}`;
      const scale = pxPerM() / 1000;
      const length = [500, 200, 100, 50, 20, 10, 5, 2, 1, 0.5, 0.2, 0.1].find((mm) => mm * scale < 130) || 0.1;
      byId("film-bar").style.width = `${length * scale}px`;
      byId("film-bar").textContent = `${length} mm`;
    }

    function tellFilm() {
      const whole = !film.slice_m, n = (count) => count.toLocaleString("en").replaceAll(",", "\u00a0");
      if (scene.is_bare) for (const it of [colour, sand]) it.parentElement.hidden = true;
      byId("film-shown").textContent = scene.is_bare ? "" : whole
        ? `All ${n(film.grains)} grains at ${film.frames} moment${film.frames === 1 ? "" : "s"}.`
        : `${n(film.grains)} of ${n(film.of_grains)} grains at ${film.frames} moments: a slice from y = ` +
          `${film.slice_m.map((y) => (1000 * y).toFixed(0)).join(" to ")} mm, each grain to scale.`;
      all.hidden = !film.beside;
      all.textContent = `Load all ${n(film.of_grains)} grains at ${film.beside_frames} moments (${(film.beside_bytes / 1e6).toFixed(1)} MB)`;
      for (const id of ["film-times", "film-slider", "film-phases"]) byId(id).hidden = film.frames < 2;
    }

    function draw(next, frame) {
      if (film !== next) {
        film = next;
        view.take(film);
        showPhases(film, byId("film-phases"));
        tellFilm();
      }
      const { shades, rgb, ends } = COLOURS[colour.value];
      const painted = scene.fields[surface.value];
      byId("film-layers").hidden = Boolean(ends) || Boolean(scene.is_bare);
      byId("film-surface-scale").hidden = !painted;
      if (painted) [byId("film-surface-low").textContent, byId("film-surface-high").textContent] = painted.ends;
      byId("film-scale").hidden = !ends;
      if (ends) [byId("film-low").textContent, byId("film-high").textContent] = ends();
      view.draw({
        frame, shade: shades(frame), rgb: rgb || scene.shades, camera: { ...camera, pxPerM: pxPerM() }, cut: cut(),
        showsSand: sand.checked, showsSolids: solids.checked, painted: painted ? Number(surface.value) : -1,
      });
      tellLook();
      tellTime(film, frame, measure, { time, slider });
    }

    const player = playFilms({
      page: { slider, play, choice, time, canvas }, stored, framesPerS: FRAMES_PER_S, unpack, draw,
      frameFor: nearestFrame,
    });

    // many moves of a hand between two pictures of the screen are drawn once
    function redraw() {
      if (waiting) return;
      waiting = true;
      requestAnimationFrame(() => {
        waiting = false;
        player.redraw();
      });
    }

    function lookFrom(name) {
      const [turn, tilt] = LOOKS[name];
      Object.assign(camera, { turn, tilt, zoom: 1, centre: [width / 2, depth / 2, height / 2] });
      redraw();
    }

    function rotate(by, over) {
      camera.turn = Math.atan2(Math.sin(camera.turn + by), Math.cos(camera.turn + by));
      camera.tilt = Math.min(Math.max(camera.tilt + over, -Math.PI / 2), Math.PI / 2);
      redraw();
    }

    function zoom(by) {
      camera.zoom = Math.min(Math.max(camera.zoom * by, 0.3), 60);
      redraw();
    }

    // of the picture, in px to the right and up
    function move(across, upwards) {
      const { right, up } = view.axes(camera), scale = pxPerM();
      camera.centre = camera.centre.map((c, k) => c - (across * right[k] + upwards * up[k]) / scale);
      redraw();
    }

    const held = new Map();
    const spread = () => {
      const [a, b] = [...held.values()];
      return Math.hypot(a.x - b.x, a.y - b.y) || 1;
    };
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      held.set(event.pointerId, { x: event.clientX, y: event.clientY });
    });
    canvas.addEventListener("pointermove", (event) => {
      const before = held.get(event.pointerId);
      if (!before) return;
      const across = event.clientX - before.x, down = event.clientY - before.y;
      const apart = held.size === 2 ? spread() : 0;
      held.set(event.pointerId, { x: event.clientX, y: event.clientY });
      if (held.size === 2) {
        zoom(spread() / apart);
        move(across / 2, -down / 2);
      } else if (event.shiftKey || event.buttons === 4) move(across, -down);
      // a finger that goes up or down scrolls the page
      else rotate(-0.01 * across, event.pointerType === "touch" ? 0 : 0.01 * down);
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => held.delete(event.pointerId));
    canvas.addEventListener("wheel", (event) => {
      if (document.activeElement !== canvas) return;
      event.preventDefault();
      zoom(Math.exp(-0.0015 * event.deltaY));
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (way && event.shiftKey) move(-40 * way[0], -40 * way[1]);
      else if (way) rotate(STEP * way[0], STEP * way[1]);
      else if (event.key === "+" || event.key === "=") zoom(1.25);
      else if (event.key === "-") zoom(0.8);
      else if (event.key === "0") lookFrom("corner");
      else return;
      event.preventDefault();
    });
    for (const name of Object.keys(LOOKS)) byId(`film-${name}`).addEventListener("click", () => lookFrom(name));
    byId("film-nearer").addEventListener("click", () => zoom(1.25));
    byId("film-farther").addEventListener("click", () => zoom(0.8));
    cutAxis.addEventListener("change", () => { setCutAxis(); redraw(); });
    cutPlace.addEventListener("input", () => { tellCut(); redraw(); });
    for (const control of [colour, sand, solids, surface]) control.addEventListener("change", redraw);

    const asked = new Map();
    window.sphereFilmArrived = (packed) => player.replace(asked.get(packed.run), packed);
    all.addEventListener("click", () => {
      const script = document.createElement("script");
      asked.set(film.run, Number(choice.value));
      script.src = film.beside;
      script.onerror = () => (byId("film-shown").textContent = `${film.beside} is not beside this page.`);
      all.hidden = true;
      byId("film-shown").textContent = `Loading ${film.beside} …`;
      document.head.append(script);
    });

    setCutAxis(scene.cut_m);
    lookFrom("corner");
  }

  const missing = byId("film-missing"), whole = byId("film-view");
  const show = (works) => ([whole.hidden, missing.hidden] = [!works, works]);
  show(true);
  unpackScene(JSON.parse(byId("film-scene").textContent)).then((scene) => {
    const view = sphereView(canvas, scene);
    if (!view) return show(false);
    canvas.addEventListener("webglcontextlost", () => show(false));
    return start(scene, view);
  }).catch((error) => {
    show(false);
    console.warn(`No 3D view: ${error.message}`);
  });
}
