//! What people look at: the table of a run, its lines as JSON, and pictures. Reports read traces and
//! gates; they decide nothing.

mod account;
mod accuracy;
mod chart;
mod columns;
mod comparison;
mod drawing;
mod junit;
mod memory;
mod page;
mod picture;
mod row;
mod scatter;
mod survey;

pub use account::{account_picture, decision_line, item_name, step_line, truth_line};
pub use accuracy::{accuracy_chart, accuracy_table, effect_table, renderer_table};
pub use chart::{Chart, Series};
pub use columns::wrapped;
pub use comparison::{Comparison, Published, TABLE_1};
pub use junit::{JunitCase, JunitEnd, junit};
pub use memory::MemoryFigures;
pub use page::{FRAME_FIGURES, Page, PageAccuracy, PageLane, PagePictures, PageScene, PageSweep};
pub use picture::{
    Shown, depth_picture, difference_picture, found_view, part_picture, picture_png, top_view,
};
pub use row::{JSON_SCHEMA, Row, table};
pub use scatter::{Dot, Scatter};
pub use survey::{TABLE_5_1, claims, found_table, time_table, work_table};
