// Plays films: a choice of runs, a slider over the frames, a button that sets them going.
//   page      elements: slider, play, choice, time, canvas
//   stored    script elements that hold the films as JSON
//   unpack    gives a film from its JSON, with its number of frames
//   draw      draws a frame of a film
//   frameFor  frame of a new film that is shown first, from the film and frame before (null at first)
// Gives redraw, and replace, which puts another film in the place of one.
function playFilms({ page, stored, framesPerS, unpack, draw, frameFor }) {
  const { slider, play, choice, time } = page, films = [];
  const isCalm = window.matchMedia("(prefers-reduced-motion: reduce)"), CALM_FRAMES_PER_S = 2;
  let film = null, timer = null;
  const redraw = () => film && draw(film, Number(slider.value));

  function pause() {
    clearInterval(timer);
    timer = null;
    play.textContent = "Play";
  }

  function start() {
    if (Number(slider.value) >= film.frames - 1) slider.value = 0;
    play.textContent = "Pause";
    timer = setInterval(() => {
      slider.value = Number(slider.value) + 1;
      redraw();
      if (Number(slider.value) >= film.frames - 1) pause();
    }, 1000 / (isCalm.matches ? CALM_FRAMES_PER_S : framesPerS));
  }

  async function show(number) {
    pause();
    try {
      films[number] = films[number] || (await unpack(JSON.parse(stored[number].textContent)));
    } catch (error) {
      time.textContent = `This browser cannot unpack the film (${error.message}).`;
      return;
    }
    const before = film, frame = Number(slider.value);
    film = films[number];
    slider.max = film.frames - 1;
    slider.value = frameFor(film, before, frame);
    redraw();
  }

  async function replace(number, packed) {
    films[number] = await unpack(packed);
    if (Number(choice.value) === number) await show(number);
  }

  play.addEventListener("click", () => (timer === null ? start() : pause()));
  slider.addEventListener("input", () => { pause(); redraw(); });
  choice.addEventListener("change", () => show(Number(choice.value)));
  new ResizeObserver(redraw).observe(page.canvas.parentElement);
  window.addEventListener("resize", redraw);
  show(0);
  return { redraw, replace };
}

// Sizes a canvas for a figure of so many metres: as wide as the page, at most 70 % of the window high.
function fittedPen(canvas, wide_m, high_m, margin_px) {
  const ratio = window.devicePixelRatio || 1, margins = 2 * margin_px;
  // 0 in a window that has no size yet
  const scale = Math.max(0, Math.min(
    (canvas.parentElement.clientWidth - margins) / wide_m, (0.7 * window.innerHeight - margins) / high_m));
  const width = scale * wide_m + margins, height = scale * high_m + margins;
  canvas.style.width = `${width}px`;
  canvas.style.height = `${height}px`;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.fillStyle = "#fff";
  pen.fillRect(0, 0, width, height);
  return { pen, scale, height };
}
