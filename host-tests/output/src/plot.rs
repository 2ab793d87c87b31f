//! Pictures of a run as SVG: charts over time, curves over a quantity and pressure maps. Readable in grey, and the same
//! bytes for the same run. And error against cost on logarithmic axes, a line along the front of the best.

mod charts;

pub use charts::{Panel, Sample, overview, steps};
use core::error::Error;
use core::f64::consts::TAU;
use fingertip::shipped::{COLUMNS, ROWS};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Pressures of the array in kPa, `[row][column]`.
pub type Pressures = [[f64; COLUMNS]; ROWS];

/// Reason why a picture could not be drawn.
pub type PlotError = Box<dyn Error + Send + Sync>;

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

const FONT: &str = "sans-serif";
const LABEL_PX: u32 = 13;
const TITLE_PX: u32 = 15;
/// Light to dark in equal steps of brightness.
const INK: RGBColor = RGBColor(20, 40, 90);
const PALE_INK: RGBColor = RGBColor(185, 195, 215);
const GOAL_INK: RGBColor = RGBColor(200, 110, 0);
const SECOND_INK: RGBColor = RGBColor(0, 130, 120);
const FAINT: RGBColor = RGBColor(225, 225, 225);

/// Every colour that a picture may have, and what a dark page has in its place.
const DARK: [(&str, &str); 7] = [
    ("#FFFFFF", "#0E1116"),
    ("#000000", "#E6EDF3"),
    ("#E1E1E1", "#30363D"),
    ("#14285A", "#8FB4FF"),
    ("#B9C3D7", "#4A5F8A"),
    ("#C86E00", "#F0A04B"),
    ("#008278", "#3FD0BF"),
];

/// A picture that follows the light or dark scheme of the page it is shown on.
fn with_dark_scheme(svg: &str) -> String {
    let drawn = svg.split(['"', '\'']).filter(|part| part.len() == 7 && part.starts_with('#'));
    for colour in drawn {
        assert!(DARK.iter().any(|(light, _)| *light == colour), "dark pages have no colour for {colour}");
    }
    let rules =
        DARK.map(|(light, dark)| format!("[fill=\"{light}\"]{{fill:{dark}}}[stroke=\"{light}\"]{{stroke:{dark}}}"));
    let style = format!("<style>@media(prefers-color-scheme:dark){{{}}}</style>", rules.concat());
    svg.replacen('>', &format!(">\n{style}"), 1)
}

/// The library draws on whole pixels, on which a slow line looks like steps: charts are drawn larger by this, and shown smaller.
const FINE: u32 = 10;

/// A number on an axis, without needless digits.
fn number(value: &f64) -> String {
    // Adding 0 turns -0 into 0.
    format!("{}", (value * 1e3).round() / 1e3 + 0.0)
}

/// Draws on an empty picture of a size.
fn picture(size_px: (u32, u32), draw: impl FnOnce(&Area<'_>) -> Result<(), PlotError>) -> Result<String, PlotError> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, size_px).into_drawing_area();
        area.fill(&WHITE)?;
        draw(&area)?;
        area.present()?;
    }
    Ok(with_dark_scheme(&svg))
}

/// Like [`picture`], drawn [`FINE`] times as large: coordinates are in these fractions of a pixel.
fn fine_picture(
    (width, height): (u32, u32),
    draw: impl FnOnce(&Area<'_>) -> Result<(), PlotError>,
) -> Result<String, PlotError> {
    let (wide, high) = (FINE * width, FINE * height);
    let svg = picture((wide, high), draw)?;
    Ok(svg.replacen(
        &format!("width=\"{wide}\" height=\"{high}\""),
        &format!("width=\"{width}\" height=\"{height}\""),
        1,
    ))
}

// Curves and points over a quantity, one panel beside the other.

/// Content of a panel.
#[derive(Clone, Debug)]
pub enum Curve {
    /// A solid line through points.
    Solid(Vec<(f64, f64)>),
    /// A thin, pale line through points.
    Pale(Vec<(f64, f64)>),
    /// A thin line in a second colour through points.
    Second(Vec<(f64, f64)>),
    /// A dashed line through points.
    Dashed(Vec<(f64, f64)>),
    /// A thin dotted line through points.
    Dotted(Vec<(f64, f64)>),
    /// A circle at each point.
    Circles(Vec<(f64, f64)>),
}

impl Curve {
    pub fn points_mut(&mut self) -> &mut Vec<(f64, f64)> {
        let (Self::Solid(points)
        | Self::Pale(points)
        | Self::Second(points)
        | Self::Dashed(points)
        | Self::Dotted(points)
        | Self::Circles(points)) = self;
        points
    }

    fn draw(&self, chart: &mut Chart<'_, '_>) -> Result<(), PlotError> {
        match self {
            Self::Solid(points) => line(chart, points, INK.stroke_width(2 * FINE)),
            Self::Pale(points) => line(chart, points, PALE_INK.stroke_width(FINE)),
            Self::Second(points) => line(chart, points, SECOND_INK.stroke_width(FINE)),
            Self::Dashed(points) => dashes(chart, points, [7, 4], GOAL_INK.stroke_width(2 * FINE)),
            Self::Dotted(points) => dashes(chart, points, [2, 3], BLACK.stroke_width(FINE)),
            Self::Circles(points) => {
                let circles = points.iter().map(|point| Circle::new(*point, 4 * FINE, BLACK.stroke_width(FINE)));
                chart.draw_series(circles)?;
                Ok(())
            }
        }
    }
}

type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

fn line(chart: &mut Chart<'_, '_>, points: &[(f64, f64)], style: ShapeStyle) -> Result<(), PlotError> {
    chart.draw_series(LineSeries::new(points.iter().copied(), style))?;
    Ok(())
}

fn dashes(
    chart: &mut Chart<'_, '_>,
    points: &[(f64, f64)],
    [dash, gap]: [u32; 2],
    style: ShapeStyle,
) -> Result<(), PlotError> {
    let line = DashedLineSeries::new(points.iter().copied(), dash * FINE, gap * FINE, style);
    chart.draw_series(line)?;
    Ok(())
}

#[derive(Clone, Debug)]
pub struct Curves<'a> {
    pub title: String,
    /// The horizontal axis, with its unit.
    pub x: &'a str,
    /// The vertical axis, with its unit.
    pub y: &'a str,
    /// Left and right end.
    pub x_range: [f64; 2],
    /// Lower and upper end.
    pub y_range: [f64; 2],
    /// First to last, the last on top.
    pub curves: Vec<Curve>,
}

impl Curves<'_> {
    fn draw(&self, area: &Area<'_>) -> Result<(), PlotError> {
        let ([left, right], [low, high]) = (self.x_range, self.y_range);
        // The margin below the title keeps it off the numbers of the axis.
        let area = area.margin(6 * FINE, 0, 0, 0).titled(&self.title, (FONT, TITLE_PX * FINE))?;
        let mut chart = ChartBuilder::on(&area)
            .margin(8 * FINE)
            .margin_right(18 * FINE)
            .x_label_area_size(36 * FINE)
            .y_label_area_size(52 * FINE)
            .build_cartesian_2d(left..right, low..high)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(FAINT.stroke_width(FINE))
            .axis_style(BLACK.stroke_width(FINE))
            .set_all_tick_mark_size(5 * FINE)
            .label_style((FONT, LABEL_PX * FINE))
            .x_desc(self.x)
            .y_desc(self.y)
            .x_label_formatter(&number)
            .y_label_formatter(&number)
            .y_labels(6)
            .x_labels(10)
            .draw()?;
        self.curves.iter().try_for_each(|curve| curve.draw(&mut chart))
    }
}

/// Panels side by side, each of a size.
pub fn curves(panels: &[Curves<'_>], panel_px: (u32, u32)) -> Result<String, PlotError> {
    if panels.is_empty() {
        return Err("cannot draw: there is no panel".into());
    }
    fine_picture((panel_px.0 * panels.len() as u32, panel_px.1), |area| {
        let areas = area.split_evenly((1, panels.len()));
        panels.iter().zip(areas).try_for_each(|(panel, area)| panel.draw(&area))
    })
}

// Pressure maps: one square for each taxel, the contact's circle dotted over them, one scale for all.

#[derive(Clone, Debug)]
pub struct Map {
    pub title: String,
    /// Pressure on each taxel, kPa.
    pub pressures_kpa: Pressures,
    /// The contact's centre from the array's middle, along columns and rows.
    pub centre_mm: [f64; 2],
    /// The contact's radius; 0 draws no circle.
    pub radius_mm: f64,
}

const MAP_PX: u32 = 280;
/// Makes the taxels squares.
const HEIGHT_PX: u32 = 295;
const SCALE_PX: u32 = 90;
const SCALE_STEPS: u32 = 64;
const DOTS: u32 = 60;

/// Maps side by side, with the scale of their colours.
pub fn maps(maps: &[Map], pitch_mm: f64) -> Result<String, PlotError> {
    if maps.is_empty() {
        return Err("cannot draw: there is no map".into());
    }
    let peak_kpa = maps.iter().flat_map(|map| map.pressures_kpa.iter().flatten()).copied().fold(1.0, f64::max);
    let full_kpa = (peak_kpa / 10.0).ceil() * 10.0;
    let maps_px = MAP_PX * maps.len() as u32;
    picture((maps_px + SCALE_PX, HEIGHT_PX), |area| {
        let (left, right) = area.split_horizontally(maps_px);
        for (map, area) in maps.iter().zip(left.split_evenly((1, maps.len()))) {
            draw_map(map, pitch_mm, full_kpa, &area)?;
        }
        draw_scale(full_kpa, &right)
    })
}

fn draw_map(map: &Map, pitch_mm: f64, full_kpa: f64, area: &Area<'_>) -> Result<(), PlotError> {
    let half_mm = 0.5 * pitch_mm * map.pressures_kpa.len() as f64;
    let mut chart = ChartBuilder::on(area)
        .margin(8)
        .caption(&map.title, (FONT, TITLE_PX))
        .x_label_area_size(36)
        .y_label_area_size(44)
        .build_cartesian_2d(-half_mm..half_mm, -half_mm..half_mm)?;
    let squares = map.pressures_kpa.iter().enumerate().flat_map(|(row, line)| {
        line.iter().enumerate().map(move |(column, kpa)| {
            let corner = |place: usize| place as f64 * pitch_mm - half_mm;
            let corners = [(corner(column), corner(row)), (corner(column + 1), corner(row + 1))];
            Rectangle::new(corners, ink(kpa / full_kpa).filled())
        })
    });
    chart.draw_series(squares)?;
    if map.radius_mm > 0.0 {
        let dot = |n: u32| {
            let angle = TAU * f64::from(n) / f64::from(DOTS);
            let [x, y] = map.centre_mm;
            (x + map.radius_mm * angle.cos(), y + map.radius_mm * angle.sin())
        };
        let inside = (0..DOTS).map(dot).filter(|(x, y)| x.abs() <= half_mm && y.abs() <= half_mm);
        chart.draw_series(inside.map(|at| Circle::new(at, 1, BLACK.filled())))?;
    }
    chart
        .configure_mesh()
        .disable_mesh()
        .label_style((FONT, LABEL_PX))
        .x_desc("columns, mm")
        .y_desc("rows, mm")
        .x_label_formatter(&number)
        .y_label_formatter(&number)
        .x_labels(5)
        .y_labels(5)
        .draw()?;
    Ok(())
}

fn draw_scale(full_kpa: f64, area: &Area<'_>) -> Result<(), PlotError> {
    let mut chart = ChartBuilder::on(area)
        .margin(8)
        .margin_right(14)
        .caption("kPa", (FONT, LABEL_PX))
        .x_label_area_size(36)
        .y_label_area_size(44)
        .build_cartesian_2d(0.0..1.0, 0.0..full_kpa)?;
    let step = |n: u32| {
        let share = |n: u32| f64::from(n) / f64::from(SCALE_STEPS);
        let corners = [(0.0, share(n) * full_kpa), (1.0, share(n + 1) * full_kpa)];
        Rectangle::new(corners, ink(share(n)).filled())
    };
    chart.draw_series((0..SCALE_STEPS).map(step))?;
    chart
        .configure_mesh()
        .disable_mesh()
        .set_all_tick_mark_size(6)
        .label_style((FONT, LABEL_PX))
        .x_labels(0)
        .y_labels(6)
        .y_label_formatter(&number)
        .draw()?;
    Ok(())
}

/// The ink for the largest pressure, more transparent for less.
fn ink(share: f64) -> RGBAColor {
    INK.mix(share.clamp(0.0, 1.0))
}

const WIDTH_PX: u32 = 1_000;
const FRONT_HEIGHT_PX: u32 = 560;
/// More points than this make the picture higher, by so much each.
const POINTS_MAX: usize = 12;
const POINT_PX: u32 = 20;
/// Width of a letter and height of a line, generously.
const LETTER_PX: f64 = 0.5 * LABEL_PX as f64;
const LINE_PX: f64 = 1.1 * LABEL_PX as f64;
/// Half of a point's width, with a little air.
const DOT_PX: f64 = 7.0;
/// Distances at which a label is tried.
const NEAR_PX: f64 = 10.0;
const STEP_PX: f64 = 5.0;
const RINGS: u32 = 50;
const DIRECTIONS: u32 = 24;
/// Distance from which a line connects the label to its point, pixels.
const FAR_PX: f64 = 14.0;

/// One point of a plot: a variant with its cost and its error.
#[derive(Clone, Debug)]
pub struct Dot {
    /// Cost.
    pub x: f64,
    /// Error; 0 is drawn on the lower axis.
    pub y: f64,
    pub label: String,
    /// True if it is on the front: filled, on the line.
    pub best: bool,
    /// True if it is drawn as a square, its label framed.
    pub own: bool,
}

#[derive(Clone, Debug)]
pub struct Front<'a> {
    pub title: &'a str,
    /// The horizontal axis, with its unit.
    pub x: &'a str,
    /// The vertical axis, with its unit.
    pub y: &'a str,
    /// The points; those of the front in order of their cost.
    pub dots: Vec<Dot>,
}

pub fn front(front: &Front<'_>) -> Result<String, PlotError> {
    let Front { title, x, y, dots } = front;
    let positive = |of: fn(&Dot) -> f64| dots.iter().map(of).filter(|value| *value > 0.0);
    let (x_low, x_high) = range(positive(|dot| dot.x))?;
    let (y_low, y_high) = range(positive(|dot| dot.y))?;
    let has_zero = dots.iter().any(|dot| dot.y <= 0.0);
    let y_low = if has_zero { y_low / 10.0 } else { y_low };
    let more = dots.len().saturating_sub(POINTS_MAX) as u32;
    picture((WIDTH_PX, FRONT_HEIGHT_PX + POINT_PX * more), |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(10)
            .margin_right(20)
            .caption(title, (FONT, TITLE_PX))
            .x_label_area_size(42)
            .y_label_area_size(66)
            .build_cartesian_2d((x_low..x_high).log_scale(), (y_low..y_high).log_scale())?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(FAINT)
            .label_style((FONT, LABEL_PX))
            .x_desc(*x)
            .y_desc(*y)
            .x_label_formatter(&power)
            .y_label_formatter(&|value| if has_zero && *value < 2.0 * y_low { "0".into() } else { power(value) })
            .draw()?;
        let place = |dot: &Dot| (dot.x.max(x_low), dot.y.max(y_low));
        let stairs = stairs(dots, place);
        let line: Vec<_> = stairs.iter().map(|at| chart.backend_coord(at)).collect();
        chart.draw_series(LineSeries::new(stairs, INK.stroke_width(1)))?;
        let places: Vec<_> = dots.iter().map(|dot| chart.backend_coord(&place(dot))).collect();
        let corners = [chart.backend_coord(&(x_low, y_high)), chart.backend_coord(&(x_high, y_low))];
        draw_dots(area, dots, &places, &line, corners)
    })
}

/// A range around all values, with room for labels.
fn range(values: impl Iterator<Item = f64>) -> Result<(f64, f64), PlotError> {
    let (low, high) = values.fold((f64::INFINITY, 0.0_f64), |(low, high), value| (low.min(value), high.max(value)));
    if low > high {
        return Err("cannot draw: there is no point".into());
    }
    Ok((0.2 * low, 4.0 * high))
}

/// A power of ten by its exponent where it is long.
fn power(value: &f64) -> String {
    let leading = value / 10_f64.powf(value.log10().floor());
    // Between the decades only 2 and 5 have room.
    if [1.0, 2.0, 5.0, 10.0].iter().all(|shown| (leading - shown).abs() > 1e-3) {
        return String::new();
    }
    if (0.001..100_000.0).contains(value) { number(value) } else { format!("1e{}", value.log10().round()) }
}

/// Step line of the front: from each point at constant error to the cost of the next point, then down.
fn stairs(dots: &[Dot], place: impl Fn(&Dot) -> (f64, f64)) -> Vec<(f64, f64)> {
    let mut line: Vec<(f64, f64)> = Vec::new();
    for (x, y) in dots.iter().filter(|dot| dot.best).map(place) {
        if let Some((_, above)) = line.last().copied() {
            line.push((x, above));
        }
        line.push((x, y));
    }
    line
}

type Pixel = (i32, i32);

/// Left, upper, right and lower side.
#[derive(Clone, Copy)]
struct Box4([f64; 4]);

impl Box4 {
    fn around(x: f64, y: f64, half_width: f64, half_height: f64) -> Self {
        Self([x - half_width, y - half_height, x + half_width, y + half_height])
    }

    fn meets(&self, other: &Self) -> bool {
        let (Self([l, u, r, d]), Self([ol, ou, or, od])) = (self, other);
        l < or && ol < r && u < od && ou < d
    }

    /// True if a straight line meets it.
    fn is_crossed(&self, from: (f64, f64), to: (f64, f64)) -> bool {
        // Enough places along the line to miss nothing of a label's size.
        (0..=40).map(|n| f64::from(n) / 40.0).any(|t| {
            let (x, y) = (from.0 + t * (to.0 - from.0), from.1 + t * (to.1 - from.1));
            self.meets(&Self::around(x, y, 1.0, 1.0))
        })
    }

    /// Point of the box nearest to another point.
    fn nearest(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let Self([left, up, right, down]) = *self;
        (x.max(left).min(right), y.max(up).min(down))
    }

    fn lies_in(&self, other: &Self) -> bool {
        let (Self([l, u, r, d]), Self([ol, ou, or, od])) = (self, other);
        l >= ol && r <= or && u >= ou && d <= od
    }
}

fn draw_dots(
    area: &Area<'_>,
    dots: &[Dot],
    places: &[Pixel],
    line: &[Pixel],
    [upper, lower]: [Pixel; 2],
) -> Result<(), PlotError> {
    let frame = Box4([upper.0, upper.1, lower.0, lower.1].map(f64::from));
    let mut taken: Vec<_> =
        places.iter().map(|(x, y)| Box4::around(f64::from(*x), f64::from(*y), DOT_PX, DOT_PX)).collect();
    taken.extend(line.windows(2).map(|ends| {
        let [(ax, ay), (bx, by)] = [ends[0], ends[1]].map(|(x, y)| (f64::from(x), f64::from(y)));
        Box4([ax.min(bx) - 1.0, ay.min(by) - 1.0, ax.max(bx) + 1.0, ay.max(by) + 1.0])
    }));
    let style = TextStyle::from((FONT, LABEL_PX).into_font()).pos(Pos::new(HPos::Center, VPos::Center));
    // Points of the front choose first.
    let order = (0..dots.len()).filter(|n| dots[*n].best).chain((0..dots.len()).filter(|n| !dots[*n].best));
    let mut leaders = Vec::new();
    for n in order {
        let dot = &dots[n];
        let at = (f64::from(places[n].0), f64::from(places[n].1));
        let half = (0.5 * LETTER_PX * dot.label.chars().count() as f64 + 3.0, 0.5 * LINE_PX + 2.0);
        // Where points crowd, a line to a label may cross what a label may not.
        let others: Vec<_> =
            places.iter().map(|(x, y)| (f64::from(*x), f64::from(*y))).filter(|other| *other != at).collect();
        let found = [(&others[..], Some(&leaders[..])), (&[], Some(&leaders)), (&[], None)]
            .into_iter()
            .find_map(|(others, lines)| free_place(at, half, &taken, lines, others, &frame));
        let (far, middle) = found.ok_or_else(|| format!("cannot draw: no room for the label {}", dot.label))?;
        let label = Box4::around(middle.0, middle.1, half.0, half.1);
        if far > FAR_PX {
            let end = label.nearest(at);
            let line = vec![places[n], (end.0 as i32, end.1 as i32)];
            area.draw(&PathElement::new(line, BLACK.mix(0.5).stroke_width(1)))?;
            leaders.push((at, end));
        }
        if dot.own {
            let Box4([left, up, right, down]) = label;
            let corners = [(left as i32, up as i32), (right as i32, down as i32)];
            area.draw(&Rectangle::new(corners, BLACK.stroke_width(1)))?;
        }
        let text = Text::new(dot.label.clone(), (middle.0 as i32, middle.1 as i32), style.clone());
        area.draw(&text)?;
        taken.push(label);
    }
    for (dot, (x, y)) in dots.iter().zip(places) {
        let fill = if dot.best { INK.filled() } else { WHITE.filled() };
        if dot.own {
            let corners = [(x - 5, y - 5), (x + 5, y + 5)];
            area.draw(&Rectangle::new(corners, fill))?;
            area.draw(&Rectangle::new(corners, INK.stroke_width(2)))?;
        } else {
            area.draw(&Circle::new((*x, *y), 4, fill))?;
            area.draw(&Circle::new((*x, *y), 4, INK.stroke_width(1)))?;
        }
    }
    Ok(())
}

type Place = (f64, f64);

fn apart(a: Place, b: Place) -> f64 {
    (a.0 - b.0).hypot(a.1 - b.1)
}

/// The nearest place for a label where it and the line to it cover nothing, nearer to its point than to another: its
/// distance from the point, and its middle.
fn free_place(
    at: Place,
    half: (f64, f64),
    taken: &[Box4],
    leaders: Option<&[(Place, Place)]>,
    others: &[Place],
    frame: &Box4,
) -> Option<(f64, Place)> {
    let own = Box4::around(at.0, at.1, 1.0, 1.0);
    for ring in 0..RINGS {
        let far = NEAR_PX + STEP_PX * f64::from(ring);
        for n in 0..DIRECTIONS {
            // Beside first, then around.
            let turn = f64::from(n / 2) * if n % 2 == 0 { 1.0 } else { -1.0 };
            let (sin, cos) = (core::f64::consts::TAU * turn / f64::from(DIRECTIONS)).sin_cos();
            let middle = (at.0 + cos * (far + half.0), at.1 - sin * (far + half.1));
            let label = Box4::around(middle.0, middle.1, half.0, half.1);
            let end = label.nearest(at);
            let covers = taken.iter().any(|other| label.meets(other))
                || leaders.into_iter().flatten().any(|(from, to)| label.is_crossed(*from, *to))
                || others.iter().any(|other| apart(label.nearest(*other), *other) < 1.5 * apart(end, at))
                || (leaders.is_some()
                    && far > FAR_PX
                    && taken.iter().any(|other| !other.meets(&own) && other.is_crossed(at, end)));
            if label.lies_in(frame) && !covers {
                return Some((far, middle));
            }
        }
    }
    None
}
