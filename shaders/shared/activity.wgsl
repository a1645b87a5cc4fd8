// A stamp holds 3 + the sub-iteration in which a tile last changed, 0 for never. What follows from pixels that did not
// change in the last two sub-iterations (both parities of the rule) does not change either, so a tile goes on only
// while its own stamp or one beside it is that fresh.
// The latest stamp of a tile and its eight neighbours:
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
