//! In: the reference photographs and height maps (SHEETLIGHT_REFERENCE). Out: judgement on what the
//! shape matcher finds there against the places and heights written in the reference's README.
//! Frame and unit: pixels, degrees, mm.

use sheetlight::find::{ModelOptions, Region, Scene, SearchOptions, ShapeModel, find};
use sheetlight::raster::{Channel, Image, load};
use std::path::PathBuf;

fn reference(path: &str) -> Option<PathBuf> {
    let Some(root) = std::env::var_os("SHEETLIGHT_REFERENCE") else {
        println!("SKIPPED: SHEETLIGHT_REFERENCE is not set, the reference photographs were not searched");
        return None;
    };
    Some(PathBuf::from(root).join(path))
}

fn scene(path: &str) -> Option<Scene> {
    let path = reference(path)?;
    let image = if path.extension().is_some_and(|e| e == "bmp") {
        bitmap(&std::fs::read(&path).unwrap())
    } else {
        load(&path, Channel::Luma, 8).unwrap()
    };
    Some(Scene::from_image(&image))
}

/// The uncompressed 8- and 24-bit bitmaps of the set; the product itself does not read this format.
fn bitmap(bytes: &[u8]) -> Image {
    let word = |at: usize| i32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let (start, w, h) = (word(10) as usize, word(18) as usize, word(22));
    let depth = usize::from(bytes[28]);
    assert!(word(30) == 0 && (depth == 8 || depth == 24), "an uncompressed bitmap");
    let (rows, stride) = (h.unsigned_abs() as usize, (depth / 8 * w).div_ceil(4) * 4);
    let mut pixels = Vec::with_capacity(w * rows);
    for y in 0..rows {
        let row = if h > 0 { rows - 1 - y } else { y };
        for x in 0..w {
            let at = start + row * stride + depth / 8 * x;
            let p = if depth == 8 { 14 + word(14) as usize + 4 * usize::from(bytes[at]) } else { at };
            let p = &bytes[p..p + 3];
            let luma = 299 * u32::from(p[2]) + 587 * u32::from(p[1]) + 114 * u32::from(p[0]);
            pixels.push(((luma + 500) / 1000) as u8);
        }
    }
    Image::from_u8(w as u32, rows as u32, pixels)
}

fn whole(scene: &Scene) -> Region {
    Region { x0: 0, y0: 0, x1: scene.width(), y1: scene.height() }
}

#[test]
fn a_tile_of_a_ring_is_found_where_it_was_cut() {
    let (Some(template), Some(scene)) = (scene("matching/ncc_photos/Dst4.bmp"), scene("matching/ncc_photos/Src4.bmp"))
    else {
        return;
    };
    let model = ShapeModel::from_region(&template, whole(&template), None, &ModelOptions::default()).unwrap();
    let options = SearchOptions { angles_deg: [-5.0, 5.0], min_score: 0.7, ..SearchOptions::default() };
    let found = find(&scene, &model, &options).unwrap();
    let m = &found[0];
    // The README gives the top left corner; the model's reference is the centre of the 33x17 template.
    let (dx, dy) = (m.pose.x - 16.0 - 219.0, m.pose.y - 8.0 - 132.0);
    assert!(dx.hypot(dy) <= 0.5, "{dx:.3} {dy:.3} px, limit 0.5");
    assert!(m.pose.angle.to_degrees().abs() <= 0.2, "{:.3} degrees, limit 0.2", m.pose.angle.to_degrees());
}

#[test]
fn overlapping_clips_are_all_found() {
    // By eye: two overlapping clips and a single one; a single one, two interlocked, one under a gear.
    let places: [(&str, &str, &[[f64; 2]]); 2] = [
        ("Dst8", "Src8", &[[168.0, 345.0], [356.0, 169.0], [465.0, 198.0]]),
        ("Dst9", "Src9", &[[133.0, 109.0], [221.0, 371.0], [202.0, 302.0], [455.0, 186.0]]),
    ];
    for (template, picture, places) in places {
        let (Some(template), Some(scene)) = (
            scene(&format!("matching/ncc_photos/{template}.bmp")),
            scene(&format!("matching/ncc_photos/{picture}.bmp")),
        ) else {
            return;
        };
        let model = ShapeModel::from_region(&template, whole(&template), None, &ModelOptions::default()).unwrap();
        let options =
            SearchOptions { max_matches: 10, max_overlap: 0.7, scales: [0.9, 1.1], ..SearchOptions::default() };
        let found = find(&scene, &model, &options).unwrap();
        for m in &found {
            println!(
                "{picture}: {:.2} {:.2} px, {:.2} degrees, score {:.3}",
                m.pose.x,
                m.pose.y,
                m.pose.angle.to_degrees(),
                m.score
            );
        }
        assert_eq!(found.len(), places.len());
        for [x, y] in places {
            assert!(found.iter().any(|m| (m.pose.x - x).hypot(m.pose.y - y) < 4.0), "none near {x} {y}");
        }
    }
}

#[test]
fn a_cross_is_found_damaged_blurred_and_inverted() {
    let (Some(train), Some(test)) =
        (scene("matching/shape_photos/case2/train.png"), scene("matching/shape_photos/case2/test.png"))
    else {
        return;
    };
    let model = ShapeModel::from_region(&train, whole(&train), None, &ModelOptions::default()).unwrap();
    let options = SearchOptions {
        max_matches: 10,
        min_score: 0.85,
        angles_deg: [-20.0, 20.0],
        scales: [0.8, 1.2],
        ..SearchOptions::default()
    };
    let strict = find(&test, &model, &options).unwrap();
    let any = find(&test, &model, &SearchOptions { ignore_polarity: true, ..options }).unwrap();
    let at = |found: &[sheetlight::find::Match]| {
        let mut x: Vec<i64> = found.iter().map(|m| (m.pose.x / 10.0).round() as i64).collect();
        x.sort_unstable();
        x
    };
    assert_eq!(at(&any), [22, 55, 87, 120], "the template's own, the damaged, the blurred and the inverted cross");
    assert_eq!(at(&strict), [22, 87], "the inverted cross and half of the damaged one have the other polarity");
}

#[test]
fn a_turned_connector_is_found() {
    let (Some(train), Some(test)) =
        (scene("matching/shape_photos/case1/train.png"), scene("matching/shape_photos/case1/test.png"))
    else {
        return;
    };
    let region = Region { x0: 105, y0: 95, x1: 400, y1: 390 };
    let model = ShapeModel::from_region(&train, region, None, &ModelOptions::default()).unwrap();
    let found =
        find(&test, &model, &SearchOptions { max_matches: 3, min_score: 0.5, ..SearchOptions::default() }).unwrap();
    assert_eq!(found.len(), 1);
    println!("connector: {:.3} degrees, score {:.3}", found[0].pose.angle.to_degrees(), found[0].score);
    assert!((found[0].pose.angle.to_degrees() - 19.7).abs() < 0.5 && found[0].warning.is_none());
}

#[test]
fn circles_of_any_size_are_found() {
    let Some(circle) = scene("matching/shape_photos/case0/templ/circle.png") else { return };
    let model = ShapeModel::from_region(&circle, whole(&circle), None, &ModelOptions::default()).unwrap();
    // A road sign, an iris (columns 158 to 257, rows 90 to 185), discs and rings of a pattern: centre and radius by
    // eye.
    let pattern = [
        [306.0, 112.0, 56.0],
        [197.0, 249.0, 44.0],
        [193.0, 135.0, 45.0],
        [124.0, 278.0, 43.5],
        [94.0, 186.0, 51.5],
        [308.0, 242.0, 51.0],
    ];
    let expected: [(&str, &[[f64; 3]]); 3] =
        [("1.jpg", &[[314.5, 189.5, 41.0]]), ("3.png", &[[208.0, 137.5, 49.0]]), ("4.png", &pattern)];
    for (name, circles) in expected {
        let test = scene(&format!("matching/shape_photos/case0/{name}")).unwrap();
        let options = SearchOptions {
            max_matches: 10,
            min_score: 0.8,
            angles_deg: [0.0, 0.0],
            scales: [0.2, 1.0],
            ignore_polarity: true,
            ..SearchOptions::default()
        };
        let found = find(&test, &model, &options).unwrap();
        for [x, y, r] in circles {
            let near = |m: &&sheetlight::find::Match| {
                (m.pose.x - x).hypot(m.pose.y - y) < 4.0 && (m.pose.scale * 200.5 - r).abs() < 3.0
            };
            assert!(found.iter().any(|m| near(&m)), "{name}: no circle near {x} {y} radius {r}");
        }
    }
}
