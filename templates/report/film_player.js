// Plays films: a choice of runs, a slider over the frames, a button that sets them going.
//   page      elements: slider, play, choice, time, canvas
//   stored    script elements that hold the films as JSON
//   unpack    gives a film from its JSON, with its number of frames
//   draw      draws a frame of a film
//   frameFor  frame of a new film that is shown first, from the film and frame before (null at first)
function playFilms({ page, stored, framesPerS, unpack, draw, frameFor }) {
  const { slider, play, choice, time } = page, films = [];
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
    }, 1000 / framesPerS);
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

  play.addEventListener("click", () => (timer === null ? start() : pause()));
  slider.addEventListener("input", () => { pause(); redraw(); });
  choice.addEventListener("change", () => show(Number(choice.value)));
  new ResizeObserver(redraw).observe(page.canvas.parentElement);
  show(0);
  return redraw;
}
