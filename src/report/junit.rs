//! JUnit XML, which CI systems read: a suite a scene, a case a lane, a failure where the gate says so, an
//! error where there was no verdict, or the device is at fault.

use quick_xml::events::{BytesDecl, BytesEnd, BytesStart, BytesText, Event};
use quick_xml::writer::Writer;

/// How a case ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum JunitEnd {
    /// Everything held.
    #[default]
    Held,
    /// What was tested failed.
    Failure,
    /// The test could not be trusted or not be ended.
    Error,
}

/// One lane.
#[derive(Clone, Debug, PartialEq)]
pub struct JunitCase {
    /// The scene: the suite.
    pub scene: String,
    /// The culler and the oracle.
    pub name: String,
    /// Wall time of its frames, seconds.
    pub seconds: f64,
    /// How it ended.
    pub end: JunitEnd,
    /// The gate's failure lines, or what kept it from a verdict; the replay line last. None where it held.
    pub failures: Vec<String>,
}

/// What XML 1.0 has no place for.
fn clean(text: &str) -> String {
    let fits =
        |c: char| matches!(c, '\t' | '\n') || (c >= ' ' && !matches!(c, '\u{fffe}' | '\u{ffff}'));
    text.chars().map(|c| if fits(c) { c } else { '\u{fffd}' }).collect()
}

/// The document. Cases of one scene follow one another.
#[must_use]
pub fn junit(cases: &[JunitCase]) -> String {
    let mut writer = Writer::new_with_indent(Vec::new(), b' ', 2);
    let mut write = |event: Event<'_>| writer.write_event(event).expect("memory takes it");
    write(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)));
    let counts = |cases: &[JunitCase]| {
        let ended = |end| cases.iter().filter(|case| case.end == end).count().to_string();
        let seconds: f64 = cases.iter().map(|case| case.seconds).sum();
        [
            ("tests", cases.len().to_string()),
            ("failures", ended(JunitEnd::Failure)),
            ("errors", ended(JunitEnd::Error)),
            ("time", format!("{seconds:.3}")),
        ]
    };
    let open = |element: &'static str, name: &str, cases: &[JunitCase]| {
        let attributes = counts(cases);
        let mut start = BytesStart::new(element);
        start.push_attribute(("name", clean(name).as_str()));
        for (key, value) in &attributes {
            start.push_attribute((*key, value.as_str()));
        }
        start
    };
    write(Event::Start(open("testsuites", "plainsight", cases)));
    for suite in cases.chunk_by(|a, b| a.scene == b.scene) {
        write(Event::Start(open("testsuite", &suite[0].scene, suite)));
        for case in suite {
            let mut start = BytesStart::new("testcase");
            start.push_attribute(("classname", clean(&case.scene).as_str()));
            start.push_attribute(("name", clean(&case.name).as_str()));
            start.push_attribute(("time", format!("{:.3}", case.seconds).as_str()));
            let element = match case.end {
                JunitEnd::Held => {
                    write(Event::Empty(start));
                    continue;
                }
                JunitEnd::Failure => "failure",
                JunitEnd::Error => "error",
            };
            write(Event::Start(start));
            let mut end = BytesStart::new(element);
            let first = case.failures.first().map_or("", String::as_str);
            end.push_attribute(("message", clean(first).as_str()));
            write(Event::Start(end));
            write(Event::Text(BytesText::new(&clean(&case.failures.join("\n")))));
            write(Event::End(BytesEnd::new(element)));
            write(Event::End(BytesEnd::new("testcase")));
        }
        write(Event::End(BytesEnd::new("testsuite")));
    }
    write(Event::End(BytesEnd::new("testsuites")));
    let mut text = String::from_utf8(writer.into_inner()).expect("text was written");
    text.push('\n');
    text
}

#[cfg(test)]
mod tests {
    use quick_xml::XmlVersion;
    use quick_xml::events::Event;
    use quick_xml::reader::Reader;

    use super::*;

    #[test]
    fn whatever_stands_in_it_it_reads_back() {
        let nasty = "a <b> & \"c\" 'd' \u{1} ü\n]]>";
        let case = |scene: &str, end, failures: &[&str]| JunitCase {
            scene: scene.to_owned(),
            name: format!("full@sim {nasty}"),
            seconds: 0.5,
            end,
            failures: failures.iter().map(|&line| line.to_owned()).collect(),
        };
        let cases = [
            case("one", JunitEnd::Held, &[]),
            case("one", JunitEnd::Failure, &[nasty, "replay: x"]),
            case("two", JunitEnd::Error, &["lost"]),
        ];
        let text = junit(&cases);
        let mut reader = Reader::from_str(&text);
        let (mut names, mut texts, mut unescaped) = (Vec::new(), Vec::new(), String::new());
        loop {
            match reader.read_event().unwrap() {
                Event::Start(start) | Event::Empty(start) => {
                    for attribute in start.attributes() {
                        let attribute = attribute.unwrap();
                        if attribute.key.as_ref() == "message" {
                            texts.push(
                                attribute
                                    .normalized_value(XmlVersion::Implicit1_0)
                                    .unwrap()
                                    .into_owned(),
                            );
                        }
                    }
                    names.push(start.name().as_ref().to_owned());
                }
                Event::Text(text) => unescaped += &text,
                Event::GeneralRef(name) => unescaped += &format!("&{};", &*name),
                Event::Eof => break,
                _ => {}
            }
        }
        let expected = [
            "testsuites",
            "testsuite",
            "testcase",
            "testcase",
            "failure",
            "testsuite",
            "testcase",
            "error",
        ];
        assert_eq!(names, expected);
        let shown = nasty.replace('\u{1}', "\u{fffd}");
        assert_eq!(texts, [shown.as_str(), "lost"]);
        assert!(unescaped.contains("replay: x"), "{unescaped}");
        assert!(
            text.contains("name=\"one\" tests=\"2\" failures=\"1\" errors=\"0\" time=\"1.000\""),
            "{text}"
        );
    }
}
