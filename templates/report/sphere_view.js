// Draws spheres, half transparent solids and the box of a 3D scene in WebGL 2.
// A sphere is a square that faces the viewer: each of its pixels finds the ball's surface and depth, so
// spheres meet and are cut as round bodies. The projection is parallel: lengths are to scale everywhere.
// Gives null where WebGL 2 is missing.
function sphereView(canvas, scene) {
  const gl = canvas.getContext("webgl2", { antialias: true, alpha: false });
  if (!gl) return null;

  const VIEW = `#version 300 es
    precision highp float;
    uniform vec3 right, up, toward, centre;
    uniform vec2 scale;
    uniform float reach;
    uniform vec4 cut;
    vec4 seen(vec3 p) {
      vec3 d = p - centre;
      return vec4(scale * vec2(dot(d, right), dot(d, up)), -dot(d, toward) / reach, 1.0);
    }`;
  const SPHERE = [`${VIEW}
    in vec2 corner;
    in float x, y, z, size, shade;
    uniform vec3 origin;
    uniform float quantum, largest;
    uniform sampler2D colours;
    out vec2 at;
    flat out vec3 middle, colour;
    flat out float radius;
    void main() {
      middle = origin + quantum * vec3(x, y, z);
      radius = largest * size;
      at = corner;
      colour = texelFetch(colours, ivec2(int(shade + 0.5), 0), 0).rgb;
      bool hidden = max(max(x, y), z) > 65534.5 || dot(cut.xyz, middle) - cut.w > radius;
      gl_Position = hidden ? vec4(2.0, 2.0, 2.0, 1.0)
        : seen(middle + radius * (corner.x * right + corner.y * up));
    }`, `${VIEW}
    in vec2 at;
    flat in vec3 middle, colour;
    flat in float radius;
    out vec4 pixel;
    void main() {
      float out2 = dot(at, at);
      if (out2 > 1.0) discard;
      float high = sqrt(1.0 - out2);
      vec3 normal = at.x * right + at.y * up + high * toward;
      vec3 p = middle + radius * normal;
      float beyond = dot(cut.xyz, p) - cut.w, edge = 1.0 - 0.35 * smoothstep(0.75, 1.0, out2);
      if (beyond > 0.0) {
        float facing = dot(cut.xyz, toward);
        if (facing < 0.001 || beyond > 2.0 * radius * high * facing) discard;
        p -= beyond / facing * toward;
        normal = cut.xyz;
        vec3 off = p - middle - dot(p - middle, normal) * normal;
        float rim = length(off) / sqrt(max(radius * radius - pow(dot(p - middle, normal), 2.0), 1e-12));
        edge = 1.0 - 0.5 * smoothstep(0.85, 1.0, rim);
      }
      vec3 light = normalize(toward + 0.5 * up - 0.35 * right);
      float bright = 0.5 + 0.5 * max(dot(normal, light), 0.0);
      pixel = vec4(colour * bright * edge, 1.0);
      gl_FragDepth = 0.5 - 0.5 * dot(p - centre, toward) / reach;
    }`];
  const SOLID = [`${VIEW}
    in vec3 place;
    in vec4 paint;
    uniform float nearer;
    out vec3 p;
    out vec4 painted;
    void main() {
      p = place;
      painted = paint;
      gl_Position = seen(place);
      gl_Position.z -= nearer;
    }`, `${VIEW}
    in vec3 p;
    in vec4 painted;
    uniform vec4 tint;
    uniform bool shaded, whole;
    out vec4 pixel;
    void main() {
      if (!whole && dot(cut.xyz, p) > cut.w) discard;
      vec3 normal = normalize(cross(dFdx(p), dFdy(p)));
      float bright = shaded ? 0.55 + 0.45 * abs(dot(normal, normalize(toward + 0.5 * up - 0.35 * right))) : 1.0;
      pixel = vec4(mix(tint.rgb, painted.rgb, painted.a) * bright, tint.a);
    }`];

  function program([vertex, fragment]) {
    const made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS) && !gl.isContextLost()) {
      const logs = gl.getAttachedShaders(made).map((shader) => gl.getShaderInfoLog(shader));
      throw new Error([gl.getProgramInfoLog(made), ...logs].join(" "));
    }
    const places = new Map();
    const uniform = (name) => {
      if (!places.has(name)) places.set(name, gl.getUniformLocation(made, name));
      return places.get(name);
    };
    return { made, uniform, attribute: (name) => gl.getAttribLocation(made, name) };
  }

  function buffer(data, kind = gl.ARRAY_BUFFER) {
    const made = gl.createBuffer();
    gl.bindBuffer(kind, made);
    gl.bufferData(kind, data, gl.STATIC_DRAW);
    return made;
  }

  function attribute(of, name, data, width, kind, normalised, each) {
    const at = of.attribute(name), made = buffer(data);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, width, kind, normalised, 0, 0);
    gl.vertexAttribDivisor(at, each);
    return made;
  }

  const spheres = program(SPHERE), solids = program(SOLID);
  gl.vertexAttrib4f(solids.attribute("paint"), 0, 0, 0, 0); // of pieces without colours of their own
  const colours = gl.createTexture();
  let grains = null, shown = {};

  // shades: one array a field
  function surface(vertices, triangles, edges, shades = []) {
    const of = (indices, colours) => {
      const array = gl.createVertexArray();
      gl.bindVertexArray(array);
      const places = attribute(solids, "place", vertices, 3, gl.FLOAT, false, 0);
      if (colours) attribute(solids, "paint", colours, 4, gl.UNSIGNED_BYTE, true, 0);
      buffer(indices, gl.ELEMENT_ARRAY_BUFFER);
      return { array, places, count: indices.length };
    };
    return { faces: of(triangles), lines: of(edges), painted: shades.map((each) => of(triangles, inColours(each))) };
  }

  // red, green, blue and 255 of each shade; four times 0 where it is not known
  function inColours(shades) {
    const bytes = scene.shades.map((hex) => [...[1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16)), 255]);
    return Uint8Array.from({ length: 4 * shades.length }, (_, n) => (bytes[shades[n >> 2]] || [0, 0, 0, 0])[n & 3]);
  }

  // the box is open at the top; corners are numbered by x, y and z as binary digits
  const [width, depth, height] = scene.size_m;
  const corners = Float32Array.from([0, 1, 2, 3, 4, 5, 6, 7].flatMap((n) => [width * (n & 1), depth * ((n >> 1) & 1), height * (n >> 2)]));
  const box = surface(corners,
    Uint32Array.from([0, 2, 3, 0, 3, 1, 0, 1, 5, 0, 5, 4, 2, 7, 3, 2, 6, 7, 0, 4, 6, 0, 6, 2, 1, 7, 5, 1, 3, 7]),
    Uint32Array.from([0, 1, 2, 3, 4, 5, 6, 7, 0, 2, 1, 3, 4, 6, 5, 7, 0, 4, 1, 5, 2, 6, 3, 7]));
  const lines = (points) => surface(Float32Array.from(points), new Uint32Array(0), Uint32Array.from(points.slice(points.length * 2 / 3).map((_, n) => n)));
  const bores = scene.bores.map(lines), marks = (scene.marks || []).map(lines);
  const parts = scene.solids.map((solid) => ({ ...solid, ...surface(solid.places, solid.faces, solid.lines, solid.shades) }));

  // radii and layers of a film, once; places and shades of a frame are set as it is shown
  function take(film) {
    if (grains) gl.deleteVertexArray(grains.array);
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    attribute(spheres, "corner", Float32Array.from([-1, -1, 1, -1, -1, 1, 1, 1]), 2, gl.FLOAT, false, 0);
    const none = new Uint16Array(film.grains);
    const buffers = ["x", "y", "z"].map((name) => attribute(spheres, name, none, 1, gl.UNSIGNED_SHORT, false, 1));
    attribute(spheres, "size", film.size, 1, gl.UNSIGNED_SHORT, true, 1);
    const shades = attribute(spheres, "shade", new Uint8Array(film.grains), 1, gl.UNSIGNED_BYTE, false, 1);
    grains = { film, array, buffers, shades };
    shown = {};
  }

  function setFrame(frame, shade) {
    const { film } = grains;
    if (shown.frame !== frame) {
      for (const axis of [0, 1, 2]) {
        gl.bindBuffer(gl.ARRAY_BUFFER, grains.buffers[axis]);
        gl.bufferSubData(gl.ARRAY_BUFFER, 0, film.at(axis, frame).subarray(0, film.grains));
      }
      for (const part of parts.filter((p) => p.bends && p.vertices === film.vertices)) {
        const places = new Float32Array(3 * film.vertices);
        for (const axis of [0, 1, 2]) {
          film.at(axis, frame).subarray(film.grains).forEach((q, n) => (places[3 * n + axis] = film.origin_m[axis] + film.quantum_m * q));
        }
        for (const of of [part.faces, part.lines]) {
          gl.bindBuffer(gl.ARRAY_BUFFER, of.places);
          gl.bufferSubData(gl.ARRAY_BUFFER, 0, places);
        }
      }
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, grains.shades);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, shade);
    shown = { frame };
  }

  function setColours(rgb) {
    const data = new Uint8Array(256 * 4).fill(255);
    rgb.forEach((hex, n) => [1, 3, 5].forEach((at, k) => (data[4 * n + k] = parseInt(hex.slice(at, at + 2), 16))));
    gl.bindTexture(gl.TEXTURE_2D, colours);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, data);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  }

  // right, up and towards the viewer for a turn about the vertical and a tilt, in rad
  function axes({ turn, tilt }) {
    const [c, s, k, h] = [Math.cos(turn), Math.sin(turn), Math.cos(tilt), Math.sin(tilt)];
    return { right: [c, s, 0], up: [-h * s, h * c, k], toward: [k * s, -k * c, h] };
  }

  function look(of, camera, cut) {
    const { right, up, toward } = axes(camera);
    gl.useProgram(of.made);
    for (const [name, value] of Object.entries({ right, up, toward, centre: camera.centre })) gl.uniform3fv(of.uniform(name), value);
    const across = 2 * camera.pxPerM;
    gl.uniform2f(of.uniform("scale"), across / canvas.clientWidth, across / canvas.clientHeight);
    gl.uniform1f(of.uniform("reach"), 4 * Math.hypot(width, depth, height));
    gl.uniform4fv(of.uniform("cut"), cut);
  }

  function paint(piece, mode, tint, { shaded = false, whole = false, nearer = 0 } = {}) {
    gl.uniform4fv(solids.uniform("tint"), tint);
    gl.uniform1i(solids.uniform("shaded"), shaded);
    gl.uniform1i(solids.uniform("whole"), whole);
    gl.uniform1f(solids.uniform("nearer"), nearer);
    gl.bindVertexArray(piece.array);
    gl.drawElements(mode, piece.count, gl.UNSIGNED_INT, 0);
  }

  // faces that are turned away first, those that face the viewer over them
  function paintThrough(piece, tint, sides) {
    gl.enable(gl.CULL_FACE);
    for (const side of sides) {
      gl.cullFace(side);
      paint(piece, gl.TRIANGLES, tint, { shaded: true });
    }
    gl.disable(gl.CULL_FACE);
  }

  function draw({ frame, shade, rgb, camera, cut, showsSand, showsSolids, painted }) {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    canvas.width = Math.round(canvas.clientWidth * ratio);
    canvas.height = Math.round(canvas.clientHeight * ratio);
    setFrame(frame, shade);
    setColours(rgb);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(1, 1, 1, 1);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const { film } = grains;
    if (showsSand) {
      look(spheres, camera, cut);
      gl.uniform3fv(spheres.uniform("origin"), film.origin_m);
      gl.uniform1f(spheres.uniform("quantum"), film.quantum_m);
      gl.uniform1f(spheres.uniform("largest"), film.largest_radius_m);
      gl.bindVertexArray(grains.array);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, film.grains);
    }
    look(solids, camera, cut);
    const standing = parts.filter((part) => showsSolids && !(part.opens && !film.is_filling[frame]));
    // opaque, so that what is in front hides what is behind
    for (const part of standing.filter((p) => p.painted[painted])) {
      paint(part.painted[painted], gl.TRIANGLES, [0.6, 0.62, 0.65, 1], { shaded: true });
    }
    paint(box.lines, gl.LINES, [0.35, 0.37, 0.39, 1], { whole: true });
    for (const part of standing) paint(part.lines, gl.LINES, [0.2, 0.22, 0.25, 1], { nearer: 1e-4 });
    if (showsSolids) for (const bore of bores) paint(bore.lines, gl.LINES, [0.04, 0.36, 0.68, 1], { nearer: 1e-4 });
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    paintThrough(box.faces, [0.75, 0.78, 0.8, 0.25], [gl.FRONT]);
    for (const part of standing.filter((p) => !p.painted[painted])) paintThrough(part.faces, scene.solid_tint, [gl.FRONT, gl.BACK]);
    gl.disable(gl.DEPTH_TEST); // marks are seen through all else
    for (const mark of marks) paint(mark.lines, gl.LINES, [0.7, 0.15, 0.12, 1], { whole: true });
    gl.bindVertexArray(null);
  }

  return { take, draw, axes };
}
