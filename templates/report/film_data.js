// What films are packed as by sandmould/drawing/animation.py.
async function inflate(data) {
  const bytes = Uint8Array.from(atob(data), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// places by axis, frame and particle, from their folded changes: low bytes before high bytes
function unfold(raw, dimension, frames, n) {
  const all = dimension * frames * n, place = new Uint16Array(all);
  for (let axis = 0, at = 0; axis < dimension; axis++) {
    for (let frame = 0; frame < frames; frame++) {
      for (let i = 0; i < n; i++, at++) {
        const folded = raw[at] | (raw[all + at] << 8);
        const change = (folded >>> 1) ^ -(folded & 1);
        place[at] = (frame ? place[at - n] : 0) + change;
      }
    }
  }
  return (axis, frame) => place.subarray((axis * frames + frame) * n, (axis * frames + frame + 1) * n);
}
