//! JUnit XML, which CI systems read: a suite a scene, a case a lane, a failure where the gate says so, an
//! error where there was no verdict.

use quick_xml::events::{BytesDecl, BytesEnd, BytesStart, BytesText, Event};
use quick_xml::writer::Writer;

/// One lane.
#[derive(Clone, Debug, PartialEq)]
pub struct JunitCase {
    /// The scene: the suite.
    pub scene: String,
    /// The culler and the oracle.
    pub name: String,
    /// Wall time of its frames, seconds.
    pub seconds: f64,
    /// What the gate says, a line each, the replay line last; none where it held.
    pub failures: Vec<String>,
    /// What kept it from a verdict, a line each, the replay line last; none where it came to one.
    pub errors: Vec<String>,
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
        let failed = cases.iter().filter(|case| !case.failures.is_empty()).count();
        let broken = cases.iter().filter(|case| !case.errors.is_empty()).count();
        let seconds: f64 = cases.iter().map(|case| case.seconds).sum();
        let [tests, failed, broken] = [cases.len(), failed, broken].map(|count| count.to_string());
        (tests, failed, broken, format!("{seconds:.3}"))
    };
    let open = |element: &'static str, name: &str, cases: &[JunitCase]| {
        let (tests, failures, errors, time) = counts(cases);
        let attributes =
            [("tests", tests), ("failures", failures), ("errors", errors), ("time", time)];
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
            if case.failures.is_empty() && case.errors.is_empty() {
                write(Event::Empty(start));
                continue;
            }
            write(Event::Start(start));
            for (element, lines) in [("failure", &case.failures), ("error", &case.errors)] {
                let Some(first) = lines.first() else { continue };
                let mut start = BytesStart::new(element);
                start.push_attribute(("message", clean(first).as_str()));
                write(Event::Start(start));
                write(Event::Text(BytesText::new(&clean(&lines.join("\n")))));
                write(Event::End(BytesEnd::new(element)));
            }
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
        let case = |scene: &str, failures: &[&str]| JunitCase {
            scene: scene.to_owned(),
            name: format!("full@sim {nasty}"),
            seconds: 0.5,
            failures: failures.iter().map(|&line| line.to_owned()).collect(),
            errors: Vec::new(),
        };
        let broken = JunitCase { errors: vec!["lost <it>".to_owned()], ..case("two", &[]) };
        let cases =
            [case("one", &[]), case("one", &[nasty, "replay: x"]), case("two", &[]), broken];
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
        let expected =
            "testsuites testsuite testcase testcase failure testsuite testcase testcase error";
        assert_eq!(names.join(" "), expected);
        let shown = nasty.replace('\u{1}', "\u{fffd}");
        assert_eq!(texts, [shown, "lost <it>".to_owned()]);
        assert!(unescaped.contains("replay: x"), "{unescaped}");
        assert!(
            text.contains("name=\"one\" tests=\"2\" failures=\"1\" errors=\"0\" time=\"1.000\""),
            "{text}"
        );
        assert!(text.contains("name=\"two\" tests=\"2\" failures=\"0\" errors=\"1\""), "{text}");
    }
}
