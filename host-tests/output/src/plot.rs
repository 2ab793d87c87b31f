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
const FAINT: RGBColor = RGBColor(225, 225, 225);

/// Every colour that a picture may have, and what a dark page has in its place.
const DARK: [(&str, &str); 6] = [
    ("#FFFFFF", "#0E1116"),
    ("#000000", "#E6EDF3"),
    ("#E1E1E1", "#30363D"),
    ("#14285A", "#8FB4FF"),
    ("#B9C3D7", "#4A5F8A"),
    ("#C86E00", "#F0A04B"),
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
    Solid(Vec<(f64, f64)>),
    /// A thin, pale line through points.
    Pale(Vec<(f64, f64)>),
    Dashed(Vec<(f64, f64)>),
    /// A thin dotted line through points.
    Dotted(Vec<(f64, f64)>),
    Circles(Vec<(f64, f64)>),
}

impl Curve {
    fn draw(&self, chart: &mut Chart<'_, '_>) -> Result<(), PlotError> {
        let dashes = |points: &[(f64, f64)], [dash, gap]: [u32; 2], style| {
            DashedLineSeries::new(points.to_vec(), dash * FINE, gap * FINE, style)
        };
        match self {
            Self::Solid(points) => chart.draw_series(LineSeries::new(points.clone(), INK.stroke_width(2 * FINE)))?,
            Self::Pale(points) => chart.draw_series(LineSeries::new(points.clone(), PALE_INK.stroke_width(FINE)))?,
            Self::Dashed(points) => chart.draw_series(dashes(points, [7, 4], GOAL_INK.stroke_width(2 * FINE)))?,
            Self::Dotted(points) => chart.draw_series(dashes(points, [2, 3], BLACK.stroke_width(FINE)))?,
            Self::Circles(points) => {
                let circle = |point: &(f64, f64)| Circle::new(*point, 4 * FINE, BLACK.stroke_width(FINE));
                chart.draw_series(points.iter().map(circle))?
            }
        };
        Ok(())
    }
}

type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

#[derive(Clone, Debug)]
pub struct Curves<'a> {
    pub title: String,
    /// The horizontal axis, with its unit.
    pub x: &'a str,
    /// The vertical axis, with its unit.
    pub y: &'a str,
    pub x_range: [f64; 2],
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
const FRONT_HEIGHT_PX: u32 = 520;
/// Width of the list of names beside the chart, and height of its lines.
const NAMES_PX: u32 = 270;
const NAME_PX: i32 = 22;

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
    /// True if it is drawn as a square.
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
    let names_px = 60 + NAME_PX as u32 * dots.len() as u32;
    picture((WIDTH_PX, FRONT_HEIGHT_PX.max(names_px)), |area| {
        let (left, right) = area.split_horizontally(WIDTH_PX - NAMES_PX);
        let mut chart = ChartBuilder::on(&left)
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
        chart.draw_series(LineSeries::new(stairs(dots, place), INK.stroke_width(1)))?;
        let places: Vec<_> = dots.iter().map(|dot| chart.backend_coord(&place(dot))).collect();
        draw_dots(&left, dots, &places)?;
        draw_names(&right, dots)
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

/// Draws the points. Each number goes to a side where it covers no other number or point, if there is one.
fn draw_dots(area: &Area<'_>, dots: &[Dot], places: &[Pixel]) -> Result<(), PlotError> {
    let mut taken = places.to_vec();
    for (n, &(x, y)) in places.iter().enumerate() {
        // The line of the front leaves a point to the right, and comes to it from above.
        let sides = [(11, -11), (-11, -11), (11, 11), (-11, 11)].map(|(right, down)| (x + right, y + down));
        let is_free = |(x, y): &Pixel| taken.iter().all(|(ox, oy)| (x - ox).abs() > 10 || (y - oy).abs() > 10);
        let side = sides.into_iter().find(is_free).unwrap_or(sides[0]);
        area.draw(&Text::new((n + 1).to_string(), side, centred(HPos::Center)))?;
        taken.push(side);
    }
    dots.iter().zip(places).try_for_each(|(dot, place)| draw_dot(area, dot, *place))
}

fn draw_dot(area: &Area<'_>, dot: &Dot, (x, y): Pixel) -> Result<(), PlotError> {
    let fill = if dot.best { INK.filled() } else { WHITE.filled() };
    if dot.own {
        let corners = [(x - 5, y - 5), (x + 5, y + 5)];
        area.draw(&Rectangle::new(corners, fill))?;
        area.draw(&Rectangle::new(corners, INK.stroke_width(2)))?;
    } else {
        area.draw(&Circle::new((x, y), 4, fill))?;
        area.draw(&Circle::new((x, y), 4, INK.stroke_width(1)))?;
    }
    Ok(())
}

fn draw_names(area: &Area<'_>, dots: &[Dot]) -> Result<(), PlotError> {
    for (n, dot) in dots.iter().enumerate() {
        let y = 40 + NAME_PX * n as i32;
        draw_dot(area, dot, (10, y))?;
        area.draw(&Text::new(format!("{}  {}", n + 1, dot.label), (24, y), centred(HPos::Left)))?;
    }
    Ok(())
}

fn centred(across: HPos) -> TextStyle<'static> {
    TextStyle::from((FONT, LABEL_PX).into_font()).pos(Pos::new(across, VPos::Center))
}
