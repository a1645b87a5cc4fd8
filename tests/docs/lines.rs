//! No line is longer than 120 characters.

const MOST: usize = 120;

/// Files that still have longer lines, with their number. The numbers may only fall.
const STILL_LONG: [(&str, usize); 41] = [
    ("CHANGELOG.md", 104),
    ("src/station/judge/viewer.js", 1),
    ("src/web/pages/base/api.js", 10),
    ("src/web/pages/base/app.js", 5),
    ("src/web/pages/base/store.js", 1),
    ("src/web/pages/base/texts.js", 66),
    ("src/web/pages/pages/calibrate.js", 23),
    ("src/web/pages/pages/health.js", 19),
    ("src/web/pages/pages/part.js", 34),
    ("src/web/pages/pages/picture.js", 21),
    ("src/web/pages/pages/position.js", 31),
    ("src/web/pages/pages/replay.js", 25),
    ("src/web/pages/pages/scan.js", 9),
    ("src/web/pages/pages/settings.js", 17),
    ("src/web/pages/pages/station.js", 8),
    ("src/web/pages/pages/surface.js", 17),
    ("src/web/pages/pages/touch.js", 13),
    ("src/web/pages/widgets/ask.js", 17),
    ("src/web/pages/widgets/bar.js", 9),
    ("src/web/pages/widgets/part/batch.js", 8),
    ("src/web/pages/widgets/part/constructions.js", 14),
    ("src/web/pages/widgets/part/drawing.js", 8),
    ("src/web/pages/widgets/part/filters.js", 13),
    ("src/web/pages/widgets/part/holegrid.js", 1),
    ("src/web/pages/widgets/part/sweep.js", 28),
    ("src/web/pages/widgets/parts.js", 16),
    ("src/web/pages/widgets/rig/auto.js", 13),
    ("src/web/pages/widgets/rig/axisgauge.js", 10),
    ("src/web/pages/widgets/rig/boards.js", 11),
    ("src/web/pages/widgets/rig/exposure.js", 11),
    ("src/web/pages/widgets/rig/region.js", 6),
    ("src/web/pages/widgets/rig/stripe.js", 6),
    ("src/web/pages/widgets/settingsform.js", 12),
    ("src/web/pages/widgets/view/cloud.js", 25),
    ("src/web/pages/widgets/view/colour.js", 4),
    ("src/web/pages/widgets/view/live.js", 7),
    ("src/web/pages/widgets/view/map.js", 18),
    ("src/web/pages/widgets/view/plot.js", 12),
    ("src/web/pages/widgets/view/scanmap.js", 9),
    ("tests/attacks/terminal.rs", 2),
    ("tests/fuzz.rs", 11),
];

#[test]
fn no_line_is_longer_than_120_characters() {
    let long = |text: &str| text.lines().filter(|l| l.chars().count() > MOST).count();
    let counts: Vec<_> = super::files(&["md", "rs", "wgsl", "js"]).iter().map(|(n, t)| (n.clone(), long(t))).collect();
    super::ratchet("lines over 120 characters", &counts, &STILL_LONG);
}
