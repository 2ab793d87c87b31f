//! The report as text; how a browser takes it is tested by `cargo xtask test`.

use crate::wall;
use sim::report::{Report, Trace, page};
use sim::run::run;
use sim::{ledger, native};

#[test]
fn a_report_stands_alone_and_has_every_part() {
    let mut scene = wall();
    scene.about = "A <b>wall</b> & more".into();
    let mut trace = Trace::new(scene.duration_s);
    let outcome = run(&scene, &native::board, &mut [&mut trace]).unwrap();
    let ablated = ledger::ablate(&scene, &native::board).unwrap();
    let page = page(&Report { scene: &scene, board: "native", outcome: &outcome, trace: &trace, ablated: &ablated });
    let page = page.unwrap();
    for part in ["bounds", "plots", "metrics", "ledger", "ablation", "scene"] {
        assert!(page.contains(&format!("<section id=\"{part}\">")), "{part}");
    }
    assert!(page.contains("A &lt;b&gt;wall&lt;/b&gt; &amp; more") && !page.contains("<b>wall"));
    assert!(page.contains("Simulated") && page.contains("row_sag") && page.contains("[[expect]]"));
    // Nothing is fetched: the only addresses are the names of XML.
    let fetched = page.replace("http://www.w3.org/2000/svg", "");
    for address in ["http:", "https:", "src=", "href=", "url(", "@import"] {
        assert!(!fetched.contains(address), "{address}");
    }
    // Every picture has words.
    assert_eq!(page.matches("role=\"img\"").count(), page.matches("aria-label=\"").count());
    assert_eq!(page.matches("Pressure map at").count(), 10);
    assert!(trace.fingers[0].maps.iter().any(|(_, map)| map.iter().flatten().any(|kpa| *kpa > 10.0)));
    if let Some(path) = std::env::var_os("FINGERTIP_REPORT") {
        std::fs::write(path, page).unwrap();
    }
}
