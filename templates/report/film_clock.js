// What films of grains say of time: where a frame lies in filling, vibration and rest.
const atRest = (stage) => stage.split("_")[0] === "rest";

function clockText(film, frame) {
  const shaken = film.vibration_time_s[frame], total = film.vibration_time_s[film.frames - 1];
  if (shaken === null) return `filling, ${film.time_s[frame].toFixed(2)} s`;
  if (atRest(film.stage[frame])) return `rest, ${film.time_s[frame].toFixed(2)} s`;
  return `vibration, ${shaken.toFixed(2)} of ${total.toFixed(2)} s`;
}

function tellTime(film, frame, measure, { time, slider }) {
  const clock = clockText(film, frame), value = film.reading[frame];
  time.textContent = value === null ? clock : `${clock} · ${measure} ${value.toFixed(3)}`;
  slider.setAttribute("aria-valuetext", clock);
}

// a strip under the slider: which frames are of filling, of vibration and of rest
function showPhases(film, strip) {
  const filling = film.vibration_time_s.filter((t) => t === null).length;
  // rests between two vibrations are short and belong to them
  const rest = [...film.stage].reverse().findIndex((stage) => !atRest(stage));
  const vibration = film.frames - filling - rest;
  strip.innerHTML = "";
  for (const [name, frames] of [["filling", filling], ["vibration", vibration], ["rest", rest]]) {
    if (!frames) continue;
    const part = document.createElement("span");
    part.textContent = name;
    part.style.flexGrow = frames;
    part.style.flexBasis = 0;
    if (name === "vibration") part.className = "shaken";
    strip.append(part);
  }
}

// another film is shown at the moment nearest to the one before
function nearestFrame(next, before, frame) {
  // there is no time of vibration while the box is filled
  const moment = (it, n) => it.vibration_time_s[n] ?? it.time_s[n] - 1e6;
  if (!before) return Math.max(next.time_s.findIndex((_, n) => next.vibration_time_s[n] !== null), 0);
  const gaps = next.time_s.map((_, n) => Math.abs(moment(next, n) - moment(before, frame)));
  return gaps.indexOf(Math.min(...gaps));
}
