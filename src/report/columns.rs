//! Text that fits a terminal: tables whose columns go into several blocks where one is too wide, and
//! lines broken at spaces. It knows words and widths, nothing of what they mean.

/// A column of figures, standing right.
pub(super) struct Column {
    /// Its heading and its least width in letters.
    pub(super) head: (&'static str, usize),
    /// One a row.
    pub(super) cells: Vec<String>,
}

/// A table: a name in front of each row, then groups of columns with bars between them.
pub(super) struct Columns {
    /// The heading of the names and their least width in letters.
    pub(super) head: (String, usize),
    /// One a row, standing left.
    pub(super) names: Vec<String>,
    /// Columns that belong together stay in one block where they fit.
    pub(super) groups: Vec<Vec<Column>>,
}

fn letters(text: &str) -> usize {
    text.chars().count()
}

impl Column {
    fn width(&self) -> usize {
        self.cells
            .iter()
            .map(|c| letters(c))
            .fold(letters(self.head.0).max(self.head.1), usize::max)
    }
}

/// Letters of columns side by side, a space before each.
fn width_of<'a>(columns: impl IntoIterator<Item = &'a Column>) -> usize {
    columns.into_iter().map(|column| column.width() + 1).sum()
}

impl Columns {
    fn name_width(&self) -> usize {
        let all = self.names.iter().chain([&self.head.0]);
        all.map(|name| letters(name)).fold(self.head.1, usize::max)
    }

    /// The table, in as many blocks as it takes for no line to be longer than `width`; `None` keeps it
    /// whole. Every block has the names in front and at least one column, however narrow `width` is.
    pub(super) fn text(&self, width: Option<usize>) -> String {
        let room = width.map_or(usize::MAX, |width| width.saturating_sub(self.name_width()));
        // Groups that do not fit even alone come apart.
        let mut pieces: Vec<Vec<&Column>> = Vec::new();
        for group in &self.groups {
            let mut piece: Vec<&Column> = Vec::new();
            for column in group {
                let with = width_of(piece.iter().copied().chain([column]));
                if !piece.is_empty() && with > room {
                    pieces.push(std::mem::take(&mut piece));
                }
                piece.push(column);
            }
            pieces.push(piece);
        }
        let mut blocks: Vec<Vec<Vec<&Column>>> = Vec::new();
        let mut used = 0;
        for piece in pieces {
            let wide = width_of(piece.iter().copied());
            // A bar and the space before it.
            match blocks.last_mut() {
                Some(block) if used + 2 + wide <= room => {
                    used += 2 + wide;
                    block.push(piece);
                }
                _ => {
                    used = wide;
                    blocks.push(vec![piece]);
                }
            }
        }
        let texts: Vec<String> = blocks.iter().map(|block| self.block(block)).collect();
        texts.join("\n")
    }

    fn block(&self, groups: &[Vec<&Column>]) -> String {
        let wide = self.name_width();
        let line = |name: &str, cell: &dyn Fn(&Column) -> String| {
            let group = |columns: &Vec<&Column>| {
                let cell = |column: &&Column| format!(" {:>1$}", cell(column), column.width());
                columns.iter().map(cell).collect::<String>()
            };
            let groups: Vec<String> = groups.iter().map(group).collect();
            format!("{name:<wide$}{}\n", groups.join(" |"))
        };
        let mut text = line(&self.head.0, &|column| column.head.0.to_owned());
        for (row, name) in self.names.iter().enumerate() {
            text += &line(name, &|column| column.cells[row].clone());
        }
        text
    }
}

/// The lines of `text`, none longer than `width` where a space allows it; what is broken goes on two
/// letters in. `None` leaves it as it is.
#[must_use]
pub fn wrapped(text: &str, width: Option<usize>) -> String {
    let Some(width) = width else { return text.to_owned() };
    let mut out = String::new();
    for line in text.split_inclusive('\n') {
        let mut used = 0;
        for word in line.split_inclusive(' ') {
            // The space after a word may stand beyond the edge.
            if used > 0 && used + letters(word.trim_end()) > width {
                out.truncate(out.trim_end_matches(' ').len());
                out += "\n  ";
                used = 2;
            }
            out += word;
            used += letters(word);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Columns {
        let column = |head: (&'static str, usize)| Column {
            head,
            cells: vec!["1.5".to_owned(), "20".to_owned()],
        };
        Columns {
            head: ("scene".to_owned(), 8),
            names: vec!["full".to_owned(), "vfc".to_owned()],
            groups: vec![
                vec![column(("ms", 6)), column(("paper", 6))],
                vec![column(("parts", 6)), column(("paper", 6))],
                vec![column(("trips", 5))],
            ],
        }
    }

    #[test]
    fn a_table_that_fits_is_one_block() {
        let whole = "scene        ms  paper |  parts  paper | trips\n\
                     full        1.5    1.5 |    1.5    1.5 |   1.5\n\
                     vfc          20     20 |     20     20 |    20\n";
        assert_eq!(table().text(None), whole);
        assert_eq!(
            table().text(Some(letters("scene        ms  paper |  parts  paper | trips"))),
            whole
        );
    }

    #[test]
    fn no_line_of_a_narrow_table_is_longer() {
        let cell_count = |text: &str| {
            text.lines()
                .map(|line| line.split_whitespace().filter(|w| *w != "|").count())
                .sum::<usize>()
        };
        for width in 15..60 {
            let text = table().text(Some(width));
            assert!(text.lines().all(|line| letters(line) <= width), "{width}:\n{text}");
            for block in text.split("\n\n") {
                let starts: Vec<&str> =
                    block.lines().map(|line| line.split_whitespace().next().unwrap()).collect();
                assert_eq!(starts, ["scene", "full", "vfc"], "{width}:\n{text}");
            }
            let blocks = text.split("\n\n").count();
            assert_eq!(cell_count(&text), 3 * (5 + blocks), "nothing is lost: {width}:\n{text}");
        }
        // At 30 each group is in one piece.
        let narrow = table().text(Some(30));
        assert!(narrow.starts_with("scene        ms  paper\n"), "{narrow}");
        assert!(narrow.ends_with("\nvfc          20     20 |    20\n"), "{narrow}");
        assert_eq!(table().text(Some(0)).split("\n\n").count(), 5, "a column in each");
    }

    #[test]
    fn long_names_move_the_columns() {
        let mut table = table();
        table.head.0 = "a-very-long-label".to_owned();
        let text = table.text(None);
        let ends: Vec<usize> = text.lines().map(letters).collect();
        assert!(ends.iter().all(|end| *end == ends[0]), "{text}");
    }

    #[test]
    fn lines_break_at_spaces() {
        assert_eq!(wrapped("one two three\nfour\n", Some(8)), "one two\n  three\nfour\n");
        assert_eq!(wrapped("a ÷ b: unbreakable", Some(5)), "a ÷\n  b:\n  unbreakable");
        assert_eq!(wrapped("one two three", None), "one two three");
    }
}
