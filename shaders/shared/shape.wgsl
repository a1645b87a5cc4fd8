// The layout that the stages of the coarse shape search share; src/stages/shape/frame.rs has the same struct.
struct ShapeFrame {
    // Size of the level, px.
    width: u32,
    height: u32,
    // Empty border around the level, px, a multiple of 4.
    margin: u32,
    // Strided grid of the search, including the border; a row has `words` u32, of four cells each.
    columns: u32,
    rows: u32,
    words: u32,
    // Words of all directions and phases of the layers before this one.
    first: u32,
    // 1: rising and falling edges count as the same.
    ignore: u32,
    // Features per turn, least sum of a hit, turns of this run, capacity of the list of hits.
    features: u32,
    least: u32,
    turns: u32,
    capacity: u32,
}
