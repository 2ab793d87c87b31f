//! The array's pressures as a heat map of coloured cells for a terminal.

use console::style;
use core::fmt::Write as _;
use fingertip::shipped::{COLUMNS, ROWS};

/// Pressures in kPa, `[row][column]`.
pub type Pressures = [[f64; COLUMNS]; ROWS];

/// Terminal colours (of the 256) from no pressure to the most; their brightness only rises.
const RAMP: [u8; 12] = [233, 17, 18, 54, 90, 126, 162, 198, 203, 209, 215, 229];

fn colour(kpa: f64, full_kpa: f64) -> u8 {
    let place = (kpa / full_kpa * RAMP.len() as f64).clamp(0.0, RAMP.len() as f64 - 1.0);
    RAMP[place as usize]
}

/// Ten lines of ten cells, the last row on top as the picture has it, `full_kpa` the brightest.
pub fn lines(pressures: &Pressures, full_kpa: f64) -> Vec<String> {
    let line = |row: &[f64; COLUMNS]| {
        let mut line = String::new();
        for kpa in row {
            // A write to a string does not fail.
            let _ = write!(line, "{}", style("  ").on_color256(colour(*kpa, full_kpa)).force_styling(true));
        }
        line
    };
    pressures.iter().rev().map(line).collect()
}

/// Legend of the colours, at least as wide as the map.
pub fn legend(full_kpa: f64) -> String {
    let cells: String =
        RAMP.iter().map(|colour| style(" ").on_color256(*colour).force_styling(true).to_string()).collect();
    format!("0 {cells} {full_kpa:.0} kPa")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_is_as_bright_as_its_taxel_is_pressed() {
        let mut pressures = [[0.0; COLUMNS]; ROWS];
        pressures[0][9] = 60.0;
        pressures[9][0] = 30.0;
        let lines = lines(&pressures, 60.0);
        assert_eq!(lines.len(), ROWS);
        // Row 0 is the lowest line; its last cell the brightest.
        assert!(lines[9].contains("\u{1b}[48;5;229m"), "{:?}", lines[9]);
        assert!(lines[0].starts_with("\u{1b}[48;5;162m"), "{:?}", lines[0]);
        for line in &lines {
            assert_eq!(console::strip_ansi_codes(line).len(), 2 * COLUMNS);
        }
    }

    #[test]
    fn pressures_beyond_the_scale_take_its_ends() {
        assert_eq!(colour(-1.0, 60.0), RAMP[0]);
        assert_eq!(colour(f64::NAN, 60.0), RAMP[0]);
        assert_eq!(colour(1e9, 60.0), RAMP[RAMP.len() - 1]);
        assert!(console::strip_ansi_codes(&legend(60.0)).ends_with("60 kPa"));
    }
}
