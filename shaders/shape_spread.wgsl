// In: one bit for each cell, for its direction. Out: how well each strided place matches each of 16 directions within a
// window of 4x4 cells: 4, 3, 1 or 0 for 0, 1, 2 or more directions off. One byte per place, ordered by direction,
// phase, row, column, so that a model's sum uses contiguous bytes ([hinterstoisser12]). Frame and unit: cells of the
// level.
@group(0) @binding(0) var<uniform> frame: ShapeFrame;
@group(0) @binding(1) var<storage, read> bits: array<u32>;
@group(0) @binding(2) var<storage, read_write> responses: array<u32>;

// The bits of the window from -2 to 1 around a cell; 0 if the cell is outside the level.
fn spread(x: i32, y: i32) -> u32 {
    var all = 0u;
    let inside = x >= 0 && y >= 0 && x < i32(frame.width) && y < i32(frame.height);
    for (var row = max(y - 2, 0); row < select(0, min(y + 2, i32(frame.height)), inside); row++) {
        for (var column = max(x - 2, 0); column < min(x + 2, i32(frame.width)); column++) {
            all |= bits[u32(row) * frame.width + u32(column)];
        }
    }
    return select(all, all | ((all << 8u) & 0xff00u) | (all >> 8u), frame.ignore != 0u);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let plane = frame.words * frame.rows;
    // y is the phase: 4 phases of the row times 4 of the column.
    if id.x < plane {
        let row = id.x / frame.words;
        let column = id.x % frame.words * 4u;
        let y = i32(row * 4u + id.y / 4u) - i32(frame.margin);
        var near: array<u32, 4>;
        for (var k = 0u; k < 4u; k++) {
            let x = i32((column + k) * 4u + id.y % 4u) - i32(frame.margin);
            // The last places of a word may lie beyond the grid; they stay empty.
            near[k] = select(0u, spread(x, y), column + k < frame.columns);
        }
        for (var want = 0u; want < 16u; want++) {
            var word = 0u;
            for (var k = 0u; k < 4u; k++) {
                // The requested direction moves to bit 2, its neighbours to bits 0, 1, 3 and 4.
                let turned = ((near[k] | (near[k] << 16u)) >> ((want + 14u) % 16u)) & 31u;
                let value = select(select(select(0u, 1u, (turned & 17u) != 0u), 3u, (turned & 10u) != 0u), 4u,
                    (turned & 4u) != 0u);
                word |= value << (8u * k);
            }
            responses[frame.first + (want * 16u + id.y) * plane + id.x] = word;
        }
    }
}
