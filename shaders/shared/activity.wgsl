// A stamp is 3 + the sub-iteration in which a tile last changed, or 0 if it never did. If neither a tile nor a
// neighbour changed in the last two sub-iterations (both parities of the rule), the tile cannot change any more. So a
// tile stays in the list only while its own stamp or a neighbour's is that recent. This is the latest stamp of a tile
// and its eight neighbours:
fn latest(tile: u32) -> u32 {
    let x = i32(tile_x(tile));
    let y = i32(tile_y(tile));
    let first = tile_shot(tile) * frame.tiles_y;
    var stamp = 0u;
    for (var dy = -1; dy <= 1; dy++) {
        let row = (first + u32(clamp(y + dy, 0, i32(frame.tiles_y) - 1))) * frame.tiles_x;
        for (var dx = -1; dx <= 1; dx++) {
            stamp = max(stamp, stamps[row + u32(clamp(x + dx, 0, i32(frame.tiles_x) - 1))]);
        }
    }
    return stamp;
}
