//! The lines in which a culler says what it drew; see the room's format. Whatever is wrong with them is an
//! error that names the line, and nothing is guessed.

use std::io::BufRead;

use serde::Deserialize;

use super::VERSION;
use crate::part::PartId;
use crate::run::Moment;

/// Bytes of the longest line that is read: an id takes at most 11, so this holds every part of any scene
/// that the truth can draw in reasonable time, and bounds what a stream without an end can take.
const LONGEST_LINE: u64 = 1 << 28;

/// Why what a culler said cannot be judged: one line with the place and the remedy.
#[derive(Debug, thiserror::Error)]
#[error("{place}: {what}")]
pub struct ForeignError {
    /// The file or process, and the line where there is one.
    pub place: String,
    /// What is wrong and what to do.
    pub what: String,
}

#[derive(Deserialize)]
struct Header {
    plainsight: String,
    version: u32,
    culler: String,
}

#[derive(Deserialize)]
struct Line {
    frame: u32,
    #[serde(default)]
    view: u32,
    drawn: Vec<u32>,
}

/// Reads what a culler says, line by line.
pub struct Drawn<'a> {
    lines: Box<dyn BufRead + 'a>,
    name: String,
    number: u64,
}

impl<'a> Drawn<'a> {
    /// Over a stream; `name` is what messages call it.
    pub fn new(lines: impl BufRead + 'a, name: impl Into<String>) -> Self {
        Self { lines: Box::new(lines), name: name.into(), number: 0 }
    }

    /// An error about the line that was read last.
    fn refuse<T>(&self, what: impl Into<String>) -> Result<T, ForeignError> {
        let place = format!("{}, line {}", self.name, self.number);
        Err(ForeignError { place, what: what.into() })
    }

    /// The next line that is not blank; `None` at the end.
    fn line(&mut self) -> Result<Option<String>, ForeignError> {
        use std::io::Read;
        loop {
            self.number += 1;
            let mut bytes = Vec::new();
            let read = (&mut self.lines).take(LONGEST_LINE).read_until(b'\n', &mut bytes);
            if let Err(error) = read {
                return self.refuse(format!("cannot be read: {error}"));
            }
            if bytes.len() as u64 == LONGEST_LINE {
                return self.refuse("is longer than 256 MiB; write one frame a line");
            }
            if bytes.is_empty() {
                return Ok(None);
            }
            let Ok(text) = String::from_utf8(bytes) else {
                return self.refuse("is not UTF-8; write JSON");
            };
            if !text.trim().is_empty() {
                return Ok(Some(text));
            }
        }
    }

    fn parse<T: for<'de> Deserialize<'de>>(
        &self,
        text: &str,
        form: &str,
    ) -> Result<T, ForeignError> {
        serde_json::from_str(text).or_else(|error| {
            let error = error.to_string().replace('\n', " ");
            self.refuse(format!("{error}; write {form}"))
        })
    }

    /// Reads the first line and returns the culler's name.
    ///
    /// # Errors
    /// Where it is none, or of another format or version.
    pub fn header(&mut self) -> Result<String, ForeignError> {
        const FORM: &str = r#"{"plainsight":"drawn","version":1,"culler":"NAME"} first"#;
        let Some(text) = self.line()? else {
            return self.refuse(format!("nothing was said; write {FORM}"));
        };
        let header: Header = self.parse(&text, FORM)?;
        if header.plainsight != "drawn" {
            let format: String = header.plainsight.chars().take(24).collect();
            let format = format.escape_debug();
            return self.refuse(format!("is of the format '{format}'; write {FORM}"));
        }
        if header.version != VERSION {
            let version = header.version;
            return self.refuse(format!("version {version} is not known; write version {VERSION}"));
        }
        // A name goes into one line of a table.
        let plain = |c: char| if c.is_control() { ' ' } else { c };
        Ok(header.culler.chars().map(plain).collect())
    }

    /// Reads what was drawn at `moment` of a scene of so many parts.
    ///
    /// # Errors
    /// Where the next line is of another moment, names a part that there is not, or is none.
    pub fn at(&mut self, moment: Moment, parts: u32) -> Result<Vec<PartId>, ForeignError> {
        const FORM: &str = r#"{"frame":0,"view":0,"drawn":[0,1]}"#;
        let Some(text) = self.line()? else {
            return self
                .refuse(format!("ends before {moment}; write a line for every frame and view"));
        };
        let line: Line = self.parse(&text, FORM)?;
        let said = Moment { frame: line.frame, view: line.view };
        if said != moment {
            return self.refuse(format!(
                "says {said} where {moment} is due; keep the order of the frames"
            ));
        }
        if let Some(part) = line.drawn.iter().find(|&&part| part >= parts) {
            return self
                .refuse(format!("there is no part {part}; the scene has {parts}, counted from 0"));
        }
        Ok(line.drawn.into_iter().map(PartId).collect())
    }

    /// Reads to the end.
    ///
    /// # Errors
    /// Where anything is left.
    pub fn end(&mut self) -> Result<(), ForeignError> {
        if self.line()?.is_some() {
            return self.refuse("comes after the last frame; judge more --frames, or write fewer");
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "{\"plainsight\":\"drawn\",\"version\":1,\"culler\":\"c\"}\n";

    /// Reads two frames of two views of a scene of five parts.
    fn read(text: &str) -> Result<Vec<Vec<PartId>>, String> {
        let mut drawn = Drawn::new(text.as_bytes(), "d.jsonl");
        let mut all = || {
            assert_eq!(drawn.header()?, "c");
            let mut frames = Vec::new();
            for (frame, view) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                frames.push(drawn.at(Moment { frame, view }, 5)?);
            }
            drawn.end()?;
            Ok(frames)
        };
        all().map_err(|error: ForeignError| error.to_string())
    }

    const LINES: [&str; 4] = [
        "{\"frame\":0,\"drawn\":[4,0,4]}\n",
        "\n{\"frame\":0,\"view\":1,\"drawn\":[],\"note\":\"ignored\"}\n",
        "{\"frame\":1,\"view\":0,\"drawn\":[1]}\n",
        "{\"frame\":1,\"view\":1,\"drawn\":[2]}",
    ];

    #[test]
    fn what_was_drawn_is_read() {
        let frames = read(&format!("{HEADER}{}", LINES.concat())).unwrap();
        let ids: Vec<Vec<u32>> =
            frames.iter().map(|parts| parts.iter().map(|part| part.0).collect()).collect();
        assert_eq!(ids, [vec![4, 0, 4], vec![], vec![1], vec![2]]);
    }

    #[test]
    fn refusals_name_the_line_and_the_remedy() {
        let all = LINES.concat();
        for (text, says) in [
            (String::new(), "d.jsonl, line 1: nothing was said"),
            ("no\n".to_owned(), "d.jsonl, line 1: expected ident"),
            (HEADER.replace('1', "2"), "line 1: version 2 is not known"),
            (HEADER.replace("drawn", "frames"), "line 1: is of the format 'frames'"),
            (format!("{HEADER}{}", LINES[0]), "line 3: ends before frame 0 view 1"),
            (format!("{HEADER}{}", LINES[2]), "line 2: says frame 1 where frame 0 is due"),
            (format!("{HEADER}{all}").replace("[1]", "[5]"), "line 5: there is no part 5"),
            (format!("{HEADER}{all}").replace("[1]", "[-1]"), "line 5: invalid value"),
            (format!("{HEADER}{all}").replace("[1]", "[1"), "line 5: expected `,` or `]`"),
            (format!("{HEADER}{all}\n{}", LINES[3]), "line 7: comes after the last frame"),
        ] {
            let error = read(&text).unwrap_err();
            assert!(error.contains(says) && !error.contains('\n'), "{text:?} said {error}");
        }
    }
}
