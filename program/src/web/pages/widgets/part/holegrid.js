// In: a grid's first hole, its columns, rows and pitch, the part's rotation. Out: centre and
// radius of every hole, mm in the map.

/** Columns go along the part's x, rows along its y; the rotation is in degrees from x towards y. */
export function places({ first, radius, columns, rows, pitch }, degrees) {
  const c = Math.cos((degrees * Math.PI) / 180),
    s = Math.sin((degrees * Math.PI) / 180),
    all = [];
  for (let j = 0; j < rows; j++)
    for (let i = 0; i < columns; i++) {
      const [x, y] = [i * pitch[0], j * pitch[1]];
      all.push([first[0] + c * x - s * y, first[1] + s * x + c * y, radius]);
    }
  return all;
}
