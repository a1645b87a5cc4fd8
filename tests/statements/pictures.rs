//! Pictures of heights and of light in every format: orientation, kinds of numbers, white, missing levels, pages,
//! colour.

use crate::tiff::{Page, tiff};
use sheetlight::fault::Fault;
use sheetlight::raster::{Channel, decode, decode_in_part};
use sheetlight::scan::{Raw, Stated, lines, read_foreign, read_foreign_page};
use std::io::Cursor;

/// 3 x 2 samples as they are stored, and as they are to be seen for each orientation from 1 to 8.
const STORED: [u8; 6] = [10, 20, 30, 40, 50, 60];
const SEEN: [[u8; 6]; 8] = [
    [10, 20, 30, 40, 50, 60],
    [30, 20, 10, 60, 50, 40],
    [60, 50, 40, 30, 20, 10],
    [40, 50, 60, 10, 20, 30],
    [10, 40, 20, 50, 30, 60],
    [40, 10, 50, 20, 60, 30],
    [60, 30, 50, 20, 40, 10],
    [30, 60, 20, 50, 10, 40],
];

fn levels(bytes: &[u8]) -> (usize, Vec<f64>) {
    match read_foreign(bytes).unwrap_or_else(|e| panic!("{e}")) {
        Raw::Picture { width, levels, .. } => (width, levels),
        raw => panic!("{raw:?}"),
    }
}

fn grey(bytes: &[u8]) -> (usize, Vec<u8>) {
    let image = decode(bytes, Channel::Luma, 8).unwrap_or_else(|e| panic!("{e}"));
    (image.width as usize, image.to_u8())
}

fn refused<T: std::fmt::Debug>(read: Result<T, Fault>, word: &str) {
    let fault = read.expect_err(word);
    let all = format!("{} {} {}", fault.what, fault.cause, fault.next);
    assert!(all.contains(word) && !fault.next.is_empty(), "wanted '{word}': {fault}");
}

/// Heights of the cloud that `import-map` makes, NaN where nothing was measured, and what it says.
fn heights(bytes: &[u8], stated: &Stated) -> Result<(Vec<f32>, String), Fault> {
    let raw = read_foreign(bytes)?;
    let Raw::Picture { width, levels, .. } = &raw else { panic!("no picture") };
    let known = Stated { unit_mm: Some(1.0), spacing_mm: Some([1.0, 1.0]), sigma_mm: Some(0.1), ..stated.clone() };
    let made = lines(&raw, None, &known)?;
    let mut z = vec![f32::NAN; levels.len()];
    made.points.iter().for_each(|p| z[p.shot as usize * width + p.u as usize] = p.position.z);
    Ok((z, made.notes.join("; ")))
}

/// A JPEG, PNG or BMP of grey levels.
fn written(size: [u32; 2], bytes: &[u8], colour: image::ExtendedColorType, format: image::ImageFormat) -> Vec<u8> {
    let mut out = Cursor::new(vec![]);
    image::write_buffer_with_format(&mut out, bytes, size[0], size[1], colour, format).unwrap();
    out.into_inner()
}

/// What a camera writes about the orientation: one tag in the first directory of a TIFF.
fn exif(orientation: u8) -> Vec<u8> {
    let mut out = b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0".to_vec();
    out.extend([orientation, 0, 0, 0, 0, 0, 0]);
    out
}

fn chunk(name: &[u8], data: &[u8]) -> Vec<u8> {
    let mut all = (data.len() as u32).to_be_bytes().to_vec();
    all.extend([name, data].concat());
    let crc = (0..all.len() - 4).fold(!0u32, |crc, i| {
        (0..8).fold(crc ^ u32::from(all[4 + i]), |c, _| if c & 1 == 1 { c >> 1 ^ 0xedb8_8320 } else { c >> 1 })
    });
    all.extend((!crc).to_be_bytes());
    all
}

/// A PNG with one more chunk, behind its header or before its end.
fn with_chunk(mut png: Vec<u8>, name: &[u8], data: &[u8], late: bool) -> Vec<u8> {
    let at = if late { png.len() - 12 } else { 33 };
    png.splice(at..at, chunk(name, data));
    png
}

#[test]
fn all_eight_orientations_are_obeyed_in_every_format() {
    let png = || written([3, 2], &STORED, image::ExtendedColorType::L8, image::ImageFormat::Png);
    for orientation in 1..=8u8 {
        let seen = SEEN[orientation as usize - 1];
        let width = if orientation > 4 { 2 } else { 3 };
        let number = u16::from(orientation);
        let plain = Page::grey([3, 2], 8, 1, STORED.to_vec()).short(274, number);
        let floats = Page::floats([3, 2], &STORED.map(f32::from)).short(274, number);
        for file in [
            tiff(std::slice::from_ref(&plain), false, false),
            tiff(&[plain], true, true),
            with_chunk(png(), b"eXIf", &exif(orientation), false),
            with_chunk(png(), b"eXIf", &exif(orientation), true),
        ] {
            assert_eq!(levels(&file), (width, seen.map(f64::from).to_vec()), "{orientation}");
            assert_eq!(grey(&file), (width, seen.to_vec()), "{orientation}");
        }
        let file = tiff(&[floats], false, true);
        assert_eq!(levels(&file), (width, seen.map(f64::from).to_vec()), "{orientation}");
        let (_, said) = heights(&file, &Stated::default()).unwrap();
        assert_eq!(said.contains(&format!("tag 274 = {orientation}")), orientation > 1, "{said}");
        // A JPEG: blocks of 8 x 8 px keep their level.
        let blocks: Vec<u8> = (0..16 * 24).map(|i| STORED[i / 24 / 8 * 3 + i % 24 / 8]).collect();
        let mut jpeg = written([24, 16], &blocks, image::ExtendedColorType::L8, image::ImageFormat::Jpeg);
        let app1 = [b"Exif\0\0".to_vec(), exif(orientation)].concat();
        let segment = [&[0xff, 0xe1], &(app1.len() as u16 + 2).to_be_bytes()[..], &app1].concat();
        jpeg.splice(2..2, segment);
        let (wide, pixels) = grey(&jpeg);
        assert_eq!(wide, 8 * width);
        let middle = |k: usize| i32::from(pixels[(8 * (k / width) + 4) * wide + 8 * (k % width) + 4]);
        (0..6).for_each(|k| assert!((middle(k) - i32::from(seen[k])).abs() < 4, "JPEG {orientation}: {k}"));
    }
    // The size that a recording declares is that of the upright picture.
    let turned = tiff(&[Page::grey([3, 2], 8, 1, STORED.to_vec()).short(274, 6)], false, false);
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.tif");
    std::fs::write(&path, turned).unwrap();
    let sized = |size| sheetlight::raster::load_sized(&path, Channel::Luma, 8, size);
    assert!(sized([2, 3]).is_ok());
    refused(sized([3, 2]), "tag 274 = 6");
    refused(read_foreign(&tiff(&[Page::floats([1, 1], &[1.0]).short(274, 9)], false, false)), "tag 274");
}

const XMP_4: &[u8] = br#"<x:xmpmeta><rdf:Description tiff:Make="a" tiff:Orientation="4"/></x:xmpmeta>"#;

#[test]
fn an_orientation_outside_exif_is_obeyed_too() {
    let png = || written([3, 2], &STORED, image::ExtendedColorType::L8, image::ImageFormat::Png);
    let app1 = [b"Exif\0\0".to_vec(), exif(4)].concat();
    let digits: String = app1.iter().map(|b| format!("{b:02x}")).collect();
    let raw = [b"Raw profile type exif\0", format!("\nexif\n{:8}\n{digits}\n", app1.len()).as_bytes()].concat();
    let xmp = [b"XML:com.adobe.xmp\0\0\0\0\0", XMP_4].concat();
    let page = Page::grey([3, 2], 8, 1, STORED.to_vec());
    for (file, by) in [
        (with_chunk(png(), b"iTXt", &xmp, false), "tiff:Orientation"),
        (with_chunk(png(), b"iTXt", &xmp, true), "tiff:Orientation"),
        (with_chunk(png(), b"tEXt", &raw, false), "Raw profile"),
        (tiff(&[page.with(700, 1, XMP_4.to_vec())], false, false), "tiff:Orientation"),
    ] {
        assert_eq!(levels(&file), (3, SEEN[3].map(f64::from).to_vec()), "{by}");
        assert_eq!(grey(&file), (3, SEEN[3].to_vec()), "{by}");
        let stated = Stated { missing: Some(None), ..Stated::default() };
        assert!(heights(&file, &stated).unwrap().1.contains(by), "{by}");
    }
    let blocks: Vec<u8> = (0..16 * 24).map(|i| STORED[i / 24 / 8 * 3 + i % 24 / 8]).collect();
    let mut jpeg = written([24, 16], &blocks, image::ExtendedColorType::L8, image::ImageFormat::Jpeg);
    let app1 = [b"http://ns.adobe.com/xap/1.0/\0", XMP_4].concat();
    jpeg.splice(2..2, [&[0xff, 0xe1], &(app1.len() as u16 + 2).to_be_bytes()[..], &app1].concat());
    let pixels = grey(&jpeg).1;
    assert!((i32::from(pixels[4 * 24 + 4]) - 40).abs() < 4 && (i32::from(pixels[12 * 24 + 4]) - 10).abs() < 4);
    // Exif has precedence, and strange numbers are refused.
    let both = with_chunk(with_chunk(png(), b"iTXt", &xmp, false), b"eXIf", &exif(2), false);
    assert_eq!(grey(&both), (3, SEEN[1].to_vec()));
    let said = heights(&both, &Stated { missing: Some(None), ..Stated::default() }).unwrap().1;
    assert!(said.contains("two orientations"), "{said}");
    let wrong = b"XML:com.adobe.xmp\0\0\0\0\0<r tiff:Orientation='9'/>";
    refused(read_foreign(&with_chunk(png(), b"iTXt", wrong, false)), "tiff:Orientation");
}

/// The matrix of ModelTransformation from column and row to x and y.
fn land([a, b, d, e]: [f64; 4], k: f64) -> Vec<f64> {
    [[a, b, 0.0, 0.0], [d, e, 0.0, 0.0], [0.0, 0.0, k, 0.0], [0.0, 0.0, 0.0, 1.0]].concat()
}

#[test]
fn a_map_of_the_land_is_not_mirrored() {
    let page = || Page::floats([3, 2], &STORED.map(f32::from));
    for (matrix, orientation) in
        [([1.0, 0.0, 0.0, -1.0], 1), ([1.0, 0.0, 0.0, 1.0], 4), ([-1.0, 0.0, 0.0, -1.0], 2), ([-1.0, 0.0, 0.0, 1.0], 1)]
    {
        let file = tiff(&[page().doubles(34_264, &land(matrix, 0.0))], false, true);
        assert_eq!(levels(&file).1, SEEN[orientation - 1].map(f64::from).to_vec(), "{matrix:?}");
        let said = heights(&file, &Stated::default()).unwrap().1;
        assert_eq!(said.contains("tag 34264"), orientation > 1, "{said}");
    }
    let upwards = |page: Page| page.doubles(34_264, &land([0.1, 0.0, 0.0, 0.1], 0.001));
    let twice = tiff(&[upwards(page().short(274, 4))], false, false);
    assert_eq!(levels(&twice).1, SEEN[3].map(f64::from).to_vec());
    let said = heights(&twice, &Stated::default()).unwrap().1;
    assert!(said.contains("0.1 x 0.1 apart") && said.contains("a height is 0.001 of a sample"), "{said}");
    refused(read_foreign(&tiff(&[upwards(page().short(274, 3))], false, false)), "tag 34264");
    // The mask of a picture is stored as the picture is.
    let mask = Page::grey([3, 2], 1, 1, vec![0b0110_0000, 0b1110_0000]).short(254, 4).short(262, 4);
    for above in [upwards(page()), page().short(274, 4)] {
        let (_, masked) = levels(&tiff(&[above, mask.clone()], false, false));
        assert!(masked[3].is_nan() && masked.iter().filter(|v| v.is_nan()).count() == 1, "{masked:?}");
    }
}

/// A file whose second page lies below the first one, which has tag 330.
fn below(pages: [Page; 2]) -> Vec<u8> {
    let [above, sub] = pages;
    let mut file = tiff(&[above.with(330, 4, vec![0; 4]), sub], false, false);
    let number = |file: &[u8], at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
    let first = number(&file, 4);
    let link = first + 2 + 12 * usize::from(u16::from_le_bytes([file[first], file[first + 1]]));
    let entry = (first + 2..link).step_by(12).find(|at| file[*at..*at + 2] == [0x4a, 1]).unwrap();
    file.copy_within(link..link + 4, entry + 8);
    file[link..link + 4].fill(0);
    file
}

#[test]
fn pages_below_a_page_are_pages() {
    let map = |v: f32| Page::floats([2, 2], &[v, v + 1.0, v + 2.0, v + 3.0]);
    let small = |v: f32| Page::floats([1, 1], &[v]);
    // A reduced copy before the map, one below it, and one that is not named as such.
    for file in [below([small(9.0).short(254, 1), map(1.0)]), below([map(1.0), small(9.0).short(254, 1)])] {
        assert_eq!(levels(&file).1, [1.0, 2.0, 3.0, 4.0]);
        assert!(heights(&file, &Stated::default()).unwrap().1.contains("reduced copies"));
    }
    assert_eq!(levels(&below([map(1.0), small(9.0)])).1, [1.0, 2.0, 3.0, 4.0]);
    let two = below([map(1.0), map(5.0)]);
    refused(read_foreign(&two), "tag 330");
    let Raw::Picture { levels: second, .. } = read_foreign_page(&two, Some(2)).unwrap() else { panic!() };
    assert_eq!(second, [5.0, 6.0, 7.0, 8.0]);
    let shades = |v: u8| Page::grey([1, 1], 8, 1, vec![v]).short(262, 0);
    assert_eq!(grey(&below([shades(9).short(254, 1), shades(7)])).1, [248]);
    // A mask below its map, and the masks of reduced copies.
    let mask = |kind: u16| Page::grey([2, 2], 1, 1, vec![0x40, 0xc0]).short(254, kind).short(262, 4);
    let seen = levels(&below([map(1.0), mask(4)])).1;
    assert!(seen[0].is_nan() && seen[1..] == [2.0, 3.0, 4.0], "{seen:?}");
    let reduced = Page::grey([1, 1], 1, 1, vec![0]).short(254, 5).short(262, 4);
    let all = [map(1.0), small(9.0).short(254, 1), mask(4), reduced.clone()];
    assert_eq!(levels(&tiff(&all, false, false)).1[1..], [2.0, 3.0, 4.0]);
    refused(read_foreign(&tiff(&[map(1.0), reduced], false, false)), "masks");
    refused(read_foreign(&tiff(&[map(1.0), mask(4), mask(4)], false, false)), "2 masks");
}

#[test]
fn a_stack_in_one_page_is_refused() {
    let page = || Page::floats([2, 1], &[1.0, 2.0]).text(270, "ImageJ=1.53\nimages=3\nslices=3\n");
    let stack = tiff(&[page()], false, false);
    refused(read_foreign(&stack), "3 pictures");
    assert!(read_foreign_page(&stack, Some(1)).is_ok());
    refused(read_foreign_page(&stack, Some(2)), "page 2");
    refused(read_foreign(b"P5 2 1 255 abP5 2 1 255 cd"), "several pictures");
    refused(decode(b"P5 2 1 255 ab\nP5 2 1 255 cd", Channel::Luma, 8), "several pictures");
    refused(read_foreign(b"P5 2 1 4095 \xff\x0f\x02\0"), "MAXVAL");
}

#[test]
fn shades_of_a_palette_are_named() {
    let stated = Stated { missing: Some(None), ..Stated::default() };
    let map: Vec<u16> = [100u16, 25_700].iter().chain(&[0; 254]).copied().collect::<Vec<_>>().repeat(3);
    let pal = tiff(&[Page::grey([2, 1], 8, 1, vec![0, 1]).short(262, 3).shorts(320, &map)], false, false);
    let same: Vec<u16> = (0..256u16).map(|i| 257 * i).collect::<Vec<_>>().repeat(3);
    let plain = tiff(&[Page::grey([2, 1], 8, 1, vec![7, 9]).short(262, 3).shorts(320, &same)], false, false);
    // Two pixels of 4 bits, 1 and 2, and 16 greys.
    let bmp = |step: u8| {
        let mut out = b"BM".to_vec();
        for v in [122u32, 0, 118, 40, 2, 1, 1 | 4 << 16, 0, 4, 0, 0, 16, 0] {
            out.extend(v.to_le_bytes());
        }
        (0..16).for_each(|i| out.extend([i * step, i * step, i * step, 0]));
        out.extend([0x12, 0, 0, 0]);
        out
    };
    for (file, wanted, named) in [
        (pal, [0.0, 100.0], true),
        (plain, [7.0, 9.0], false),
        (indexed(&[3, 3, 3, 4, 4, 4], &[]), [3.0, 4.0], true),
        (indexed(&[0, 0, 0, 1, 1, 1], &[]), [0.0, 1.0], false),
        (bmp(17), [17.0, 34.0], true),
        (bmp(1), [1.0, 2.0], false),
    ] {
        assert_eq!(levels(&file).1, wanted);
        assert_eq!(heights(&file, &stated).unwrap().1.contains("palette"), named, "{wanted:?}");
    }
}

#[test]
fn a_unit_of_the_file_that_differs_is_named() {
    let page = || Page::floats([2, 1], &[1.0, 2.0]);
    let gdal = "<GDALMetadata><Item name='UNITTYPE' sample='0' role='unittype'>metre</Item></GDALMetadata>";
    let ratio = |a: u32, b: u32| [a.to_le_bytes(), b.to_le_bytes()].concat();
    let resolved = |text: &str| page().text(270, text).with(282, 5, ratio(10, 1)).with(283, 5, ratio(10, 1));
    let ome = r#"<OME><Pixels PhysicalSizeX="250" PhysicalSizeY="0.25" PhysicalSizeYUnit="mm"/></OME>"#;
    for (page, wanted) in [
        (page().text(42_112, gdal), "--unit-mm 1000"),
        (page().shorts(34_735, &[1, 1, 0, 1, 4099, 0, 1, 9002]), "--unit-mm 304.8"),
        (page().text(270, "ImageJ=1.53\nvunit=micron\n"), "--unit-mm 0.001"),
        (resolved("ImageJ=1.53\nunit=mm\n"), "0.1 x 0.1 apart, in mm"),
        (page().text(270, ome), "0.25 x 0.25 apart, in mm"),
    ] {
        let (z, said) = heights(&tiff(&[page], false, false), &Stated::default()).unwrap();
        assert!(z == [1.0, 2.0] && said.contains(wanted) && said.contains("as stated"), "{said}");
    }
    for page in [page().text(270, "ImageJ=1.53\nvunit=mm\n"), resolved("printed at 10 dpi")] {
        assert!(!heights(&tiff(&[page], false, false), &Stated::default()).unwrap().1.contains("as stated"));
    }
}

#[test]
fn every_kind_of_number_is_read_as_written() {
    let wide = |v: &[i64], bytes: usize| v.iter().flat_map(|v| v.to_le_bytes()[..bytes].to_vec()).collect::<Vec<u8>>();
    let kinds: Vec<(u16, u16, Vec<i64>, Vec<u8>)> = vec![
        (8, 1, vec![0, 1, 255], wide(&[0, 1, 255], 1)),
        (8, 2, vec![-128, -1, 127], wide(&[-128, -1, 127], 1)),
        (16, 1, vec![0, 4095, 65_535], wide(&[0, 4095, 65_535], 2)),
        (16, 2, vec![-32_768, -1, 32_767], wide(&[-32_768, -1, 32_767], 2)),
        (32, 1, vec![0, 7, 4_294_967_295], wide(&[0, 7, 4_294_967_295], 4)),
        (32, 2, vec![-2_147_483_648, -5, 2_147_483_647], wide(&[-2_147_483_648, -5, 2_147_483_647], 4)),
        (64, 1, vec![0, 7, 1 << 50], wide(&[0, 7, 1 << 50], 8)),
        (64, 2, vec![-(1 << 50), -7, 3], wide(&[-(1 << 50), -7, 3], 8)),
        (16, 3, vec![1, -2, 1024], [0x3c00u16, 0xc000, 0x6400].iter().flat_map(|v| v.to_le_bytes()).collect()),
        (32, 3, vec![1, -2, 1024], [1f32, -2.0, 1024.0].iter().flat_map(|v| v.to_le_bytes()).collect()),
        (64, 3, vec![1, -2, 1024], [1f64, -2.0, 1024.0].iter().flat_map(|v| v.to_le_bytes()).collect()),
        (1, 1, vec![1, 0, 1], vec![0b1010_0000]),
        (2, 1, vec![3, 0, 2], vec![0b1100_1000]),
        (4, 1, vec![15, 0, 9], vec![0xf0, 0x90]),
    ];
    for (bits, format, wanted, data) in kinds {
        for (big, swapped) in [(false, false), (false, true), (true, false), (true, true)] {
            let file = tiff(&[Page::grey([3, 1], bits, format, data.clone())], big, swapped);
            let wanted: Vec<f64> = wanted.iter().map(|v| *v as f64).collect();
            assert_eq!(levels(&file), (3, wanted), "{bits} bits, format {format}, big {big}, swapped {swapped}");
            if bits > 16 || format > 1 {
                refused(decode(&file, Channel::Luma, 16), "levels of light");
            }
        }
    }
    // Shades of few bits are stretched for pictures of light: the largest is saturation.
    let four = tiff(&[Page::grey([3, 1], 4, 1, vec![0xf0, 0x90])], false, false);
    assert_eq!(grey(&four), (3, vec![255, 0, 153]));
}

#[test]
fn what_is_not_followed_is_named() {
    let page = || Page::grey([2, 1], 8, 1, vec![1, 2]);
    let two = || Page::grey([2, 1], 8, 1, vec![1, 2, 3, 4]).short(277, 2).shorts(258, &[8, 8]);
    let three = || Page::grey([1, 1], 8, 1, vec![1, 2, 3, 4]).short(277, 4).shorts(258, &[8; 4]).short(262, 2);
    for (page, word) in [
        (page().short(266, 2), "FillOrder"),
        (page().short(262, 5), "CMYK"),
        (page().short(262, 6), "YCbCr"),
        (page().short(262, 8), "L*a*b*"),
        (page().short(262, 32_803), "32803, a raw mosaic"),
        (page().short(339, 5), "SampleFormat"),
        (page().short(258, 12), "BitsPerSample"),
        (page().short(339, 3), "SampleFormat"),
        (page().short(259, 34_887), "ompression"),
        (page().short(259, 50_000), "ompression"),
        (two(), "ExtraSamples"),
        (two().short(338, 0), "ExtraSamples"),
        (three().short(338, 0), "ExtraSamples"),
        (page().text(42_113, "none"), "GDAL_NODATA"),
        (page().text(270, "ImageJ=1.54f\ncf=8\nc0=1\nc1=2\n"), "ImageJ"),
        (page().short(262, 3), "ColorMap"),
    ] {
        let file = tiff(&[page], false, false);
        refused(read_foreign(&file), word);
        refused(decode(&file, Channel::Luma, 8), word);
    }
}

#[test]
fn white_is_zero_turns_light_round_and_no_heights() {
    let white = |page: Page| tiff(&[page.short(262, 0)], false, false);
    let eight = white(Page::grey([3, 1], 8, 1, vec![0, 10, 255]));
    assert_eq!(levels(&eight), (3, vec![0.0, 10.0, 255.0]));
    assert_eq!(grey(&eight), (3, vec![255, 245, 0]));
    let one = white(Page::grey([3, 1], 1, 1, vec![0b1010_0000]));
    assert_eq!(levels(&one), (3, vec![1.0, 0.0, 1.0]));
    assert_eq!(grey(&one), (3, vec![0, 255, 0]));
    let deep = white(Page::grey([2, 1], 16, 1, vec![0, 0, 1, 0]));
    assert_eq!(levels(&deep).1, [0.0, 1.0]);
    assert_eq!(decode(&deep, Channel::Luma, 16).unwrap().get(1, 0), 65_534);
    refused(decode(&deep, Channel::Luma, 12), "tag 262");
    for (bits, format, data, wanted) in [
        (32, 3, 0.3f32.to_le_bytes().to_vec(), f64::from(0.3f32)),
        (64, 3, 0.3f64.to_le_bytes().to_vec(), 0.3),
        (16, 2, (-7i16).to_le_bytes().to_vec(), -7.0),
    ] {
        for swapped in [false, true] {
            let page = Page::grey([1, 1], bits, format, data.clone()).short(262, 0);
            let file = tiff(&[page], swapped, swapped);
            assert_eq!(levels(&file).1, [wanted]);
            let missing = Some(None);
            assert!(heights(&file, &Stated { missing, ..Stated::default() }).unwrap().1.contains("tag 262"));
        }
    }
    // The light beside heights is light.
    let raw = read_foreign(&tiff(&[Page::floats([3, 1], &[1.0; 3])], false, false)).unwrap();
    let stated = Stated { unit_mm: Some(1.0), spacing_mm: Some([1.0; 2]), sigma_mm: Some(0.1), ..Stated::default() };
    let made = lines(&raw, Some(&read_foreign(&eight).unwrap()), &stated).unwrap();
    assert_eq!(made.points.iter().map(|p| p.intensity).collect::<Vec<_>>(), [255.0, 245.0, 0.0]);
    let light = read_foreign(&white(Page::floats([3, 1], &[1.0; 3]))).unwrap();
    refused(lines(&raw, Some(&light), &stated), "0 is white");
}

#[test]
fn a_level_named_as_missing_is_missing_in_every_kind() {
    let floats = |v: f32| Page::floats([3, 1], &[1.5, v, 2.5]);
    let whole = |v: i16| Page::grey([3, 1], 16, 2, [1, v, 2].iter().flat_map(|v| v.to_le_bytes()).collect());
    let half = Page::grey([3, 1], 16, 3, [0x3c00u16, 0xf0e2, 0x4000].iter().flat_map(|v| v.to_le_bytes()).collect());
    for (page, text) in [
        (floats(-9999.0), "-9999"),
        (floats(-9999.0), " -9999.0 "),
        (floats(-99.9999), "-99.9999"),
        (floats(f32::MIN), "-3.4028234663852886e+38"),
        (floats(f32::MIN), "-3.40282346638529e+38"),
        (floats(999.999), "999.999"),
        (floats(0.0), "0"),
        (floats(f32::NAN), "nan"),
        (whole(-32_768), "-32768"),
        (whole(0), "0"),
        (half, "-9999"),
    ] {
        for (big, swapped) in [(false, false), (true, true)] {
            // Some writers leave the mark out that ends a text.
            for page in [page.clone().text(42_113, text), page.clone().with(42_113, 2, text.as_bytes().to_vec())] {
                let (z, said) = heights(&tiff(&[page], big, swapped), &Stated::default()).unwrap();
                assert!(z[1].is_nan() && z[0] > 0.9 && z[2] > 1.9, "{text}: {z:?}");
                assert!(said.contains("GDAL_NODATA"), "{said}");
            }
        }
    }
    // Stated by a person, in the words of a person.
    for level in [-99.9999, 999.999, -9999.0, 3.4e38] {
        let file = tiff(&[floats(level as f32)], false, false);
        let stated = Stated { missing: Some(Some(level)), ..Stated::default() };
        assert!(heights(&file, &stated).unwrap().0[1].is_nan(), "{level}");
    }
    // Pictures of light: such pixels are hidden.
    let shades = tiff(&[Page::grey([3, 1], 8, 1, vec![9, 0, 9]).text(42_113, "0")], false, false);
    refused(decode(&shades, Channel::Luma, 8), "GDAL_NODATA");
    let hidden = decode_in_part(&shades, Channel::Luma, 8).unwrap().1.unwrap();
    assert!(hidden.get(1, 0) && hidden.count() == 1);
}

#[test]
fn scales_and_distances_of_the_file_are_honoured_or_said() {
    let xml = "<GDALMetadata><Item name=\"SCALE\" sample=\"0\" role=\"scale\">0.5</Item>\
               <Item name=\"OFFSET\" sample=\"0\" role=\"offset\">10</Item></GDALMetadata>";
    let signed = "ImageJ=1.54f\ncf=0\nc0=-32768\nc1=1\n";
    let page = |v: u16| Page::grey([2, 1], 16, 1, [v, v + 2].iter().flat_map(|v| v.to_le_bytes()).collect());
    let stated = Stated { missing: Some(None), ..Stated::default() };
    for (page, wanted, tag) in [
        (page(4).text(42_112, xml), [12.0, 13.0], "tag 42112"),
        (page(4).text(42_112, &xml.replace('"', "'")), [12.0, 13.0], "tag 42112"),
        (page(32_769).text(270, signed), [1.0, 3.0], "tag 270"),
        (page(4).doubles(33_550, &[0.25, 0.25, 0.0]), [4.0, 6.0], "tag 33550"),
    ] {
        let (z, said) = heights(&tiff(&[page], false, false), &stated).unwrap();
        assert!(z == wanted && said.contains(tag), "{z:?} {said}");
    }
}

#[test]
fn one_page_of_full_size_is_read() {
    let map = |v: f32| Page::floats([2, 1], &[v, v + 1.0]);
    let small = |v: f32| Page::floats([1, 1], &[v]);
    let mask = |bits: u8| Page::grey([2, 1], 1, 1, vec![bits]).short(254, 4).short(262, 4);
    for (pages, wanted) in [
        (vec![small(9.0).short(254, 1), map(1.0)], vec![1.0, 2.0]),
        (vec![map(1.0), small(9.0).short(254, 1), small(8.0).short(254, 1)], vec![1.0, 2.0]),
        (vec![small(9.0).short(255, 2), map(1.0)], vec![1.0, 2.0]),
        (vec![map(1.0).short(254, 1)], vec![1.0, 2.0]),
        (vec![map(1.0).short(254, 2)], vec![1.0, 2.0]),
    ] {
        assert_eq!(levels(&tiff(&pages, false, false)).1, wanted);
        assert_eq!(levels(&tiff(&pages, true, true)).1, wanted);
    }
    let (_, masked) = levels(&tiff(&[map(1.0), mask(0b0100_0000)], false, false));
    assert!(masked[0].is_nan() && masked[1] == 2.0);
    let two = tiff(&[map(1.0), small(9.0).short(254, 1), map(5.0)], false, false);
    refused(read_foreign(&two), "2 pages");
    refused(read_foreign_page(&two, Some(3)), "page 3");
    refused(read_foreign_page(&two, Some(0)), "page 0");
    let Raw::Picture { levels, .. } = read_foreign_page(&two, Some(2)).unwrap() else { panic!() };
    assert_eq!(levels, [5.0, 6.0]);
    let shades = Page::grey([1, 1], 8, 1, vec![7]);
    refused(decode(&tiff(&[shades.clone(), shades.clone()], false, false), Channel::Luma, 8), "2 pages");
    refused(
        read_foreign_page(&written([1, 1], &[7], image::ExtendedColorType::L8, image::ImageFormat::Png), Some(1)),
        "page",
    );
    // A list of pages that leads back to its beginning, and one that leads out of the file.
    for (pages, word) in [(vec![shades.clone(); 2], "without an end"), (vec![shades.clone()], "cycle")] {
        let mut ring = tiff(&pages, false, false);
        let end = ring.len() - 4;
        ring.copy_within(4..8, end);
        refused(decode(&ring, Channel::Luma, 8), word);
    }
    let mut ring = tiff(&[shades], false, false);
    let end = ring.len() - 4;
    ring[end..].copy_from_slice(&0x7fff_ffffu32.to_le_bytes());
    assert_eq!(grey(&ring), (1, vec![7]));
}

#[test]
fn colours_are_refused_where_one_number_is_meant() {
    use image::{ExtendedColorType as Kind, ImageFormat::Bmp, ImageFormat::Png};
    let colours = [10, 20, 30, 10, 10, 10];
    let greys = [20, 20, 20, 10, 10, 10];
    let palette = |red: u16| {
        let mut map = vec![0u16; 768];
        [(0, 0, 0x0500u16), (0, 1, 0x0500), (0, 2, red << 8), (1, 0, 0x0700), (1, 1, 0x0700), (1, 2, 0x0700)]
            .iter()
            .for_each(|(n, c, v)| map[256 * c + n] = *v);
        tiff(&[Page::grey([2, 1], 8, 1, vec![0, 1]).short(262, 3).shorts(320, &map)], false, true)
    };
    let rgb = |v: &[u8]| {
        tiff(&[Page::grey([2, 1], 8, 1, v.to_vec()).short(262, 2).short(277, 3).shorts(258, &[8; 3])], false, false)
    };
    // Planes one after another: red, then green, then blue.
    let planes =
        Page::grey([2, 1], 8, 1, vec![10, 10, 20, 10, 30, 10]).short(262, 2).short(277, 3).shorts(258, &[8; 3]);
    for (coloured, grey_file, wanted) in [
        (written([2, 1], &colours, Kind::Rgb8, Png), written([2, 1], &greys, Kind::Rgb8, Png), [20.0, 10.0]),
        (written([2, 1], &colours, Kind::Rgb8, Bmp), written([2, 1], &greys, Kind::Rgb8, Bmp), [20.0, 10.0]),
        (rgb(&colours), rgb(&greys), [20.0, 10.0]),
        (palette(9), palette(5), [5.0, 7.0]),
        (indexed(&[1, 2, 3, 4, 4, 4], &[]), indexed(&[3, 3, 3, 4, 4, 4], &[]), [3.0, 4.0]),
    ] {
        refused(read_foreign(&coloured), "colour");
        assert_eq!(levels(&grey_file).1, wanted);
        assert!(decode(&coloured, Channel::Green, 8).is_ok());
    }
    assert_eq!(decode(&rgb(&colours), Channel::Blue, 8).unwrap().to_u8(), [30, 10]);
    let offsets = tiff(&[planes.planes(3)], false, false);
    assert_eq!(decode(&offsets, Channel::Green, 8).unwrap().to_u8(), [20, 10]);
    refused(read_foreign(&written([8, 8], &[9; 64], Kind::L8, image::ImageFormat::Jpeg)), "JPEG");
    refused(read_foreign(b"P4 8 1\n\xaa"), "two shades");
}

/// A PNG of two pixels that name colours 0 and 1 of a palette.
fn indexed(palette: &[u8], alpha: &[u8]) -> Vec<u8> {
    let mut out = vec![];
    let mut encoder = png::Encoder::new(&mut out, 2, 1);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Four);
    encoder.set_palette(palette.to_vec());
    if !alpha.is_empty() {
        encoder.set_trns(alpha.to_vec());
    }
    encoder.write_header().unwrap().write_image_data(&[0x01]).unwrap();
    out
}

fn plain_png(colour: png::ColorType, depth: png::BitDepth, width: u32, data: &[u8], clear: &[u8]) -> Vec<u8> {
    let mut out = vec![];
    let mut encoder = png::Encoder::new(&mut out, width, 1);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    if !clear.is_empty() {
        encoder.set_trns(clear.to_vec());
    }
    encoder.write_header().unwrap().write_image_data(data).unwrap();
    out
}

#[test]
fn transparent_pixels_are_not_measured_and_not_seen() {
    use png::{BitDepth::*, ColorType::*};
    let alpha_tiff = |kind: u16, a: u8| {
        let page = Page::grey([2, 1], 8, 1, vec![5, a, 6, 255]).short(277, 2).shorts(258, &[8; 2]).short(338, kind);
        tiff(&[page], false, false)
    };
    for (file, level) in [
        (plain_png(GrayscaleAlpha, Eight, 2, &[5, 0, 6, 255], &[]), 6.0),
        (plain_png(GrayscaleAlpha, Sixteen, 2, &[0, 5, 0, 0, 1, 0, 255, 255], &[]), 256.0),
        (plain_png(Rgba, Eight, 2, &[5, 5, 5, 0, 6, 6, 6, 255], &[]), 6.0),
        (plain_png(Grayscale, Eight, 2, &[5, 6], &[0, 5]), 6.0),
        (plain_png(Grayscale, Four, 2, &[0x56], &[0, 5]), 6.0),
        (plain_png(Rgb, Eight, 2, &[5, 5, 5, 6, 6, 6], &[0, 5, 0, 5, 0, 5]), 6.0),
        (indexed(&[5, 5, 5, 6, 6, 6], &[0]), 6.0),
        (alpha_tiff(1, 0), 6.0),
        (alpha_tiff(2, 0), 6.0),
    ] {
        let (_, seen) = levels(&file);
        assert!(seen[0].is_nan() && seen[1] == level, "{seen:?}");
        // A file that marks its missing pixels need not be told which level is missing.
        assert!(heights(&file, &Stated::default()).unwrap().1.contains("transparent"));
        let bits = if level > 255.0 { 16 } else { 8 };
        refused(decode(&file, Channel::Luma, bits), "transparent");
        let (_, hidden) = decode_in_part(&file, Channel::Luma, bits).unwrap();
        assert!(hidden.unwrap().get(0, 0));
    }
    for veiled in
        [plain_png(GrayscaleAlpha, Eight, 2, &[5, 128, 6, 255], &[]), alpha_tiff(2, 100), indexed(&[5; 6], &[77])]
    {
        refused(read_foreign(&veiled), "in part");
        refused(decode_in_part(&veiled, Channel::Luma, 8), "in part");
    }
    // Colours under hidden pixels are no colours.
    let (_, seen) = levels(&plain_png(Rgba, Eight, 2, &[1, 2, 3, 0, 6, 6, 6, 255], &[]));
    assert!(seen[0].is_nan() && seen[1] == 6.0, "{seen:?}");
    refused(read_foreign(&plain_png(Rgba, Eight, 2, &[1, 2, 3, 255, 6, 6, 6, 255], &[])), "colour");
    let opaque = plain_png(Rgba, Eight, 2, &[5, 5, 5, 255, 6, 6, 6, 255], &[]);
    assert_eq!(grey(&opaque), (2, vec![5, 6]));
}

#[test]
fn levels_are_not_stretched_and_what_is_said_of_them_is_told() {
    use png::{BitDepth::*, ColorType::*};
    for (depth, data, wanted, shown) in [
        (One, vec![0b1000_0000], vec![1.0, 0.0], vec![255, 0]),
        (Two, vec![0b1101_0000], vec![3.0, 1.0], vec![255, 85]),
        (Four, vec![0xf2], vec![15.0, 2.0], vec![255, 34]),
        (Eight, vec![255, 2], vec![255.0, 2.0], vec![255, 2]),
    ] {
        let file = plain_png(Grayscale, depth, 2, &data, &[]);
        assert_eq!(levels(&file).1, wanted);
        assert_eq!(grey(&file).1, shown);
    }
    for (file, wanted) in [
        (&b"P2 2 1 15 15 2"[..], vec![15.0, 2.0]),
        (b"P5 2 1 15 \x0f\x02", vec![15.0, 2.0]),
        (b"P2 2 1 4095 4095 2", vec![4095.0, 2.0]),
        (b"P5 2 1 4095 \x0f\xff\0\x02", vec![4095.0, 2.0]),
    ] {
        assert_eq!(levels(file).1, wanted);
    }
    refused(read_foreign(b"P6 1 1 4095 \0\x01\0\x01\0\x01"), "MAXVAL");
    let twelve = with_chunk(plain_png(Grayscale, Sixteen, 1, &[0xff, 0xf0], &[]), b"sBIT", &[12], false);
    let (z, said) = heights(&twelve, &Stated { missing: Some(None), ..Stated::default() }).unwrap();
    assert!(z == [65_520.0] && said.contains("sBIT"), "{z:?} {said}");
    // An animation has other pictures that nobody would look at.
    let film = with_chunk(plain_png(Grayscale, Eight, 1, &[9], &[]), b"acTL", &[0, 0, 0, 3, 0, 0, 0, 0], false);
    refused(read_foreign(&film), "animation");
    refused(decode(&film, Channel::Luma, 8), "animation");
}
