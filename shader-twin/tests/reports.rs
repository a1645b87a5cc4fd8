//! Reports: an independent XML reader counts what the JUnit file says; Markdown stays one table row a line.

mod common;

use quick_xml::Reader;
use quick_xml::events::Event;
use shader_twin::{Binding, Case, Device, Pair, Report, Shape, Stage, Tolerance, Words};

type Element = (String, Vec<(String, String)>);

/// Elements by name with their attributes, as the reader unescapes them, and all text.
fn read(xml: &str) -> (Vec<Element>, String) {
    let mut reader = Reader::from_str(xml);
    reader.config_mut().check_end_names = true;
    let (mut elements, mut text) = (Vec::new(), String::new());
    loop {
        let event = reader.read_event().unwrap_or_else(|e| panic!("{e}\n{xml}"));
        match event {
            Event::Start(e) | Event::Empty(e) => {
                let value = |a: quick_xml::events::attributes::Attribute| {
                    let key = a.key.as_ref().to_owned();
                    (key, quick_xml::escape::unescape(&a.value).unwrap().into_owned())
                };
                let name = e.name().as_ref().to_owned();
                elements.push((name, e.attributes().map(|a| value(a.unwrap())).collect()));
            }
            Event::Text(t) => text += &t,
            Event::Eof => break,
            _ => {}
        }
    }
    (elements, text)
}

fn attribute<'a>(element: &'a Element, key: &str) -> &'a str {
    element.1.iter().find(|(k, _)| k == key).map_or("", |(_, value)| value)
}

/// A shader whose second case differs, with a name that XML and Markdown would read otherwise.
fn pair(wgsl_add: &str, stage: &str) -> Pair {
    let text = format!(
        "@group(0) @binding(0) var<storage, read_write> words: array<u32>;
        @compute @workgroup_size(1) fn main() {{ words[0] = words[0] * words[0]{wgsl_add}; }}"
    );
    let words = Binding::read_write("words", Shape::array::<u32>(), Tolerance::exact("whole numbers"));
    let twin = |b: &mut [Words], _: &Case| {
        let word = &mut b[0].get_mut::<u32>()[0];
        *word *= *word;
    };
    let case = |name: &str, word: u32| Case::new(name, [1, 1, 1]).with(&[word, 3]);
    let cases = vec![case("a < b & \"c\" | \u{1}", 4), case("five", 5)];
    Pair::new(Stage::new(stage, &text, "main", [1, 1, 1], vec![words]), twin, cases)
}

fn report(device: &Device) -> Report {
    let mut report = Report::new("Squares <all>", device);
    report.add(pair("", "right").run(device));
    // Differs where bit 2 of the word is set and bit 0 as well: in the case "five" only.
    report.add(pair(" + (words[0] & 1u)", "differs").run(device));
    let mut contract = pair("", "contract");
    contract.stage.workgroup = [2, 1, 1];
    report.add(contract.run(device));
    report
}

#[test]
fn junit_counts_what_ran() {
    let Some(device) = common::device() else { return };
    let xml = report(&device).junit();
    // XML forbids the sign in attributes; the reader below takes it.
    assert!(xml.contains("name=\"case: a &lt; b &amp; &quot;c&quot; | ?\""), "{xml}");
    let (elements, text) = read(&xml);
    let suites: Vec<_> = elements.iter().filter(|e| e.0 == "testsuite").collect();
    let counts =
        |e: &Element| ["name", "tests", "failures", "errors", "skipped"].map(|key| attribute(e, key).to_owned());
    assert_eq!(counts(suites[0]), ["right", "4", "0", "0", "0"]);
    assert_eq!(counts(suites[1]), ["differs", "4", "1", "0", "1"]);
    assert_eq!(counts(suites[2]), ["contract", "2", "0", "1", "1"]);
    let of = |name: &str| elements.iter().filter(|e| e.0 == name).count();
    assert_eq!((of("testcase"), of("failure"), of("error"), of("skipped")), (10, 1, 1, 2));
    assert!(elements.iter().any(|e| attribute(e, "name") == "case: a < b & \"c\" | ?"));
    let adapter = elements.iter().find(|e| e.0 == "property" && attribute(e, "name") == "adapter").unwrap();
    assert_eq!(attribute(adapter, "value"), device.adapter().name);
    let failure = elements.iter().find(|e| e.0 == "failure").unwrap();
    assert!(attribute(failure, "message").contains("worst at words[0]: device 0x0000001a (26"), "{failure:?}");
    assert!(text.contains("@workgroup_size is [1, 1, 1] in WGSL, [2, 1, 1] in Rust"));
}

#[test]
fn markdown_names_what_failed_and_keeps_its_tables() {
    let Some(device) = common::device() else { return };
    let text = report(&device).markdown();
    assert!(text.starts_with("# Squares"), "{text}");
    assert!(text.contains("Verdict: **FAILED**") && text.contains("\n| five | FAILED | 2 words, 1 beyond the limit"));
    assert!(text.contains("\n| a &lt; b &amp; \"c\" \\| "), "{text}");
    for row in text.lines().filter(|l| l.starts_with('|')) {
        let bars = row.replace("\\|", "").matches('|').count();
        assert!([4, 5, 6].contains(&bars), "{row}");
    }
}

#[test]
fn a_skipped_run_has_not_passed_and_says_so() {
    let skipped = Report::skipped("Squares", "no adapter <here>");
    assert!(!skipped.passed());
    assert!(skipped.markdown().contains("**SKIPPED: no shader was tested.** no adapter"));
    assert!(skipped.to_string().contains("SKIPPED, no shader was tested"));
    let (elements, _) = read(&skipped.junit());
    let skip = elements.iter().find(|e| e.0 == "skipped").unwrap();
    assert_eq!(attribute(skip, "message"), "no adapter <here>");
}

#[test]
fn an_empty_report_has_not_passed_and_files_are_written() {
    let Some(device) = common::device() else { return };
    let mut report = Report::new("Squares", &device);
    assert!(!report.passed());
    report.add(pair("", "right").run(&device));
    assert!(report.passed(), "{report}");
    let folder = std::env::temp_dir().join(format!("shader-twin-{}", std::process::id())).join("deep");
    report.write(&folder).unwrap();
    assert_eq!(std::fs::read_to_string(folder.join("junit.xml")).unwrap(), report.junit());
    assert_eq!(std::fs::read_to_string(folder.join("report.md")).unwrap(), report.markdown());
    let blocked = report.write(&folder.join("report.md")).unwrap_err();
    assert!(blocked.what().contains("report.md cannot be written"), "{blocked}");
    std::fs::remove_dir_all(folder.parent().unwrap()).unwrap();
}
