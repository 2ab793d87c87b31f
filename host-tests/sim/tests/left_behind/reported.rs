//! The report as text; how a browser takes it is tested by `cargo xtask test`.

use crate::wall;
use sim::metrics::Verdict;
use sim::report::{Over, Report, Trace, page};
use sim::run::run;
use sim::{cli, ledger, native};

/// What draws the plots; its licence stands before it.
const LIBRARY: &str =
    include_str!(concat!(env!("FINGERTIP_ROOT"), "/host-tests/sim/src/report/uplot/uPlot.iife.min.js"));

#[test]
fn a_report_stands_alone_and_has_every_part() {
    let mut scene = wall();
    scene.about = "A <b>wall</b> & more".into();
    let mut trace = Trace::new(scene.duration_s);
    let outcome = run(&scene, &native::board, &mut [&mut trace]).unwrap();
    let ablated = ledger::ablate(&scene, &native::board).unwrap();
    let page = page(&Report {
        scene: &scene,
        board: "native",
        outcome: &outcome,
        trace: &trace,
        ablated: &ablated,
        over: None,
    });
    let page = page.unwrap();
    for part in ["bounds", "plots", "metrics", "ledger", "ablation", "scene"] {
        assert!(page.contains(&format!("<section id=\"{part}\">")), "{part}");
    }
    assert!(page.contains("A &lt;b&gt;wall&lt;/b&gt; &amp; more") && !page.contains("<b>wall"));
    assert!(page.contains("Simulated") && page.contains("row_sag") && page.contains("[[expect]]"));
    // The control error is drawn to the scale of the holds: the approach is off by the whole goal.
    let plots = &trace.fingers[0];
    let [[low, high], held] = [&plots.control_error, &plots.held_error].map(|track| track.ends().unwrap());
    assert!(low < -900.0 && high < 100.0 && held[0] > -50.0 && held[1] < 50.0, "{low} to {high}, held {held:?}");
    assert!(page.contains("the axis fits the holds"));
    // Nothing is fetched, and nothing may be: the only addresses are XML's names, and the library's of itself.
    assert!(page.contains("content=\"default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'\""));
    assert_eq!(page.matches(LIBRARY).count(), 1);
    let fetched = page.replace(LIBRARY, "").replace("http://www.w3.org/2000/svg", "");
    for address in ["http:", "https:", "src=", "href=", "url(", "@import"] {
        assert!(!fetched.contains(address), "{address}");
    }
    // Every picture has words.
    let pictures: Vec<&str> = page.split(" role=\"img\"").skip(1).collect();
    assert!(pictures.len() > 20, "{} pictures", pictures.len());
    assert!(pictures.iter().all(|tag| tag.split('>').next().unwrap().contains(" aria-label=\"")));
    assert_eq!(page.matches("Pressure map at").count(), 10);
    let instants = &trace.fingers[0].instants;
    assert_eq!(instants.len(), 150);
    assert!(instants.iter().any(|at| at.true_kpa.iter().flatten().any(|kpa| *kpa > 10.0)));
    assert!(instants.iter().any(|at| at.codes.iter().flatten().any(|code| *code > 100)));
    // Its size is bounded by its stretches and maps, whatever the run's length.
    assert!(page.len() < 1_000_000, "{} bytes", page.len());
    if let Some(path) = std::env::var_os("FINGERTIP_REPORT") {
        std::fs::write(path, page).unwrap();
    }
}

#[test]
fn what_is_broken_comes_first_and_the_rest_is_folded() {
    let scene = cli::load(crate::SCENE, &["duration_s=0.05".into()], None).unwrap();
    assert_eq!(scene.set, ["duration_s=0.05"]);
    let mut trace = Trace::new(scene.duration_s);
    let mut outcome = run(&scene, &native::board, &mut [&mut trace]).unwrap();
    let held = Verdict { held: true, ..outcome.verdicts[0].clone() };
    let mut broken = Verdict { held: false, ..held.clone() };
    broken.bound.metric = "energy_j".into();
    outcome.verdicts = vec![held, broken];
    let report = Report { scene: &scene, board: "native", outcome: &outcome, trace: &trace, ablated: &[], over: None };
    let page = page(&report).unwrap();
    let at = |part: &str| page.find(part).unwrap_or_else(|| panic!("no {part}"));
    assert!(at("<code>duration_s=0.05</code>") < at("1 of 2 bounds broken"));
    assert!(at("1 of 2 bounds broken") < at("<code>energy_j</code>"));
    assert!(at("<code>energy_j</code>") < at("<details><summary>1 held</summary>"));
    let groups: Vec<&str> = page.split("<details class=\"group\"").skip(1).collect();
    assert!(groups.len() > 4 && groups[0].starts_with(" open><summary>Motor and energy"), "{}", &groups[0][..80]);
    assert!(groups[1..].iter().all(|group| group.starts_with("><summary>")));
}

#[test]
fn a_report_lies_over_another_whatever_the_scenes_are_called() {
    let mut scene = wall();
    scene.name = "</script><script>alert(1)</script><!--".into();
    scene.about = scene.name.clone();
    let mut trace = Trace::new(scene.duration_s);
    let outcome = run(&scene, &native::board, &mut [&mut trace]).unwrap();
    let page = |over| {
        page(&Report { scene: &scene, board: "native", outcome: &outcome, trace: &trace, ablated: &[], over }).unwrap()
    };
    let alone = page(None);
    // Its data, the library, the scripts of the page.
    assert_eq!((alone.matches("<script").count(), alone.matches("</script>").count()), (3, 3));
    let over = Over::of(&alone).unwrap();
    let both = page(Some(&over));
    assert_eq!((both.matches("<script").count(), both.matches("</script>").count()), (4, 4));
    assert!(!both.contains("<!--"));
    // The other run lies in it as it lay in its own page.
    let data =
        |page: &str, begin: &str| page.split_once(begin).unwrap().1.split_once("</script>").unwrap().0.to_owned();
    let [own, other] =
        ["run", "over"].map(|id| data(&both, &format!("<script type=\"application/json\" id=\"{id}\">")));
    assert_eq!(own, other);
    for (wrong, why) in [
        ("<p>a page</p>".to_owned(), "no report"),
        (alone.split_at(alone.find("\"fingers\"").unwrap() + 20).0.to_owned(), "cut off"),
        (alone.replace("id=\"run\">{", "id=\"run\">{{"), "damaged"),
        (alone.replace("\"format\":1,", "\"format\":99,"), "format 99, 1 is asked for"),
    ] {
        let error = Over::of(&wrong).unwrap_err();
        assert!(error.contains(why) && error.contains("--out"), "{error}");
    }
}
