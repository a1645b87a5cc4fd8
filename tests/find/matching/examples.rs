//! In: pictures of brackets with print that differs from one to the next. Out: judgement on templates of several
//! examples: what varies drops out, what stays is found better.
//! Frame and unit: pixels of 320x256 pictures; the bracket's origin is the middle of its region.

use crate::shapes::{part, printed};
use sheetlight::find::{
    Example, Match, ModelOptions, Pose, Scene, SearchOptions, Template, Weak, find_taught, teach_examples,
};
use sheetlight::raster::{Image, Mask};

const REGION: [u32; 4] = [112, 88, 97, 81];
/// Middle of the region.
const STILL: Pose = Pose { x: 160.0, y: 128.0, angle: 0.0, scale: 1.0 };

fn taught(pictures: &[Image]) -> sheetlight::fault::Result<Template> {
    let example = |(k, image)| Example { image, hidden: None, picture: format!("{k}.png"), sha256: "0".repeat(64) };
    let examples: Vec<Example> = pictures.iter().enumerate().map(example).collect();
    teach_examples("bracket", &examples, Some(REGION), &ModelOptions::default(), None)
}

fn specimen() -> (Image, Pose) {
    let pose = Pose { x: 143.3, y: 117.8, angle: -0.4, scale: 1.0 };
    (printed(&[pose], 77, false), pose)
}

fn found(template: &Template, image: &Image) -> Match {
    let (scene, weak) = (Scene::from_image(image), Weak::default());
    let list = find_taught(&scene, template, &SearchOptions::default(), Some(&weak), None, None).unwrap();
    list.into_iter().next().expect("the bracket")
}

/// Number of edge points farther than 3 px inside the plate's outline and holes: those of print.
fn on_print(template: &Template) -> usize {
    template.model.levels[0].iter().filter(|p| part(p.x, p.y) < -3.0).count()
}

#[test]
fn what_varies_drops_out_and_a_new_specimen_scores_higher() {
    let poses = [STILL, Pose { x: 171.4, y: 120.9, angle: 0.9, scale: 1.0 }, Pose { angle: -2.2, ..STILL }];
    let pictures: Vec<Image> = (0..3).map(|k| printed(&[poses[k]], 10 + k as u64, false)).collect();
    let (one, three) = (taught(&pictures[..1]).unwrap(), taught(&pictures).unwrap());
    for (e, pose) in three.examples.iter().zip(&poses[1..]) {
        let turn = e.angle_deg - pose.angle.to_degrees();
        assert!((e.x_px - pose.x).hypot(e.y_px - pose.y) < 0.2 && turn.abs() < 0.3, "{e:?}");
    }
    let (image, pose) = specimen();
    let (single, common) = (found(&one, &image), found(&three, &image));
    println!(
        "one: {} of {} edges on print, score {:.3}, correlation {:?}; three: {} of {}, {:.3}, {:?}; {:?} stayed",
        on_print(&one),
        one.model.levels[0].len(),
        single.score,
        single.correlation,
        on_print(&three),
        three.model.levels[0].len(),
        common.score,
        common.correlation,
        three.confirmed
    );
    assert!((common.pose.x - pose.x).hypot(common.pose.y - pose.y) < 0.1);
    assert!(common.score > single.score + 0.2 && common.score > 0.85);
    assert!(common.correlation.unwrap() > single.correlation.unwrap() + 0.02);
    let (before, after) = (on_print(&one), on_print(&three));
    assert!(before > 100 && after * 4 < before, "{before} edges on print became {after}");
    let [stayed, all] = three.confirmed.unwrap();
    assert!(stayed < all && stayed >= three.model.levels[0].len());
    // Most of the background counts, and much of the printed plate does not.
    let levels = three.levels.as_ref().unwrap();
    let counts = |inside: fn(f64) -> bool| {
        let place = |i: usize| (f64::from((i % 97) as u32) - 48.0, f64::from((i / 97) as u32) - 40.0);
        let of: Vec<bool> = (0..levels.values.len())
            .filter(|&i| inside(part(place(i).0, place(i).1)))
            .map(|i| levels.values[i] > 0)
            .collect();
        of.iter().filter(|c| **c).count() as f64 / of.len() as f64
    };
    let (outside, inside) = (counts(|d| d > 4.0), counts(|d| d < -3.0));
    println!("{:.3} of the background and {:.3} of the plate count", outside, inside);
    assert!(outside > 0.97 && inside < 0.6);
}

#[test]
fn two_examples_of_the_same_print_keep_it() {
    let same = [printed(&[STILL], 10, false), printed(&[STILL], 10, false)];
    let [stayed, all] = taught(&same).unwrap().confirmed.unwrap();
    assert!(stayed == all, "{stayed} of {all}");
}

#[test]
fn a_picture_without_the_part_is_refused_by_its_name() {
    let without = Image::from_u8(320, 256, (0..320 * 256).map(|i| 60 + (i % 3) as u8).collect());
    let said = taught(&[printed(&[STILL], 10, false), printed(&[STILL], 11, false), without]).unwrap_err().what;
    assert!(said.contains("not found in 2.png"), "{said}");
}

#[test]
fn what_a_mask_excludes_counts_neither_as_edge_nor_as_grey() {
    let (image, hidden) = (printed(&[STILL], 10, false), Mask::from_fn(320, 256, |x, _| x < 150));
    let source = ("a.png".to_owned(), "0".repeat(64));
    let options = ModelOptions::default();
    let taught = Template::teach_in_part("bracket", &image, Some(&hidden), Some(REGION), source, &options).unwrap();
    assert!(taught.model.levels[0].iter().all(|p| p.x + STILL.x > 149.0));
    let levels = taught.levels.unwrap().values;
    assert!(levels.iter().enumerate().all(|(i, v)| (*v == 0) == (112 + i % 97 < 150)));
}
