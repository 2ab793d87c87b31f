-- A sweep's runs as Parquet, and their spread, by DuckDB; in the sweep's folder:
--   duckdb < summary.sql
-- A cell is empty where a run has no such value.
CREATE TABLE runs AS SELECT * FROM read_csv('runs.csv', header = true, sample_size = -1);
COPY runs TO 'runs.parquet' (FORMAT parquet, COMPRESSION zstd);

SELECT
    count(*) AS runs,
    100.0 * avg(passed) AS passed_percent,
    min(peak_force_n) AS peak_min_n,
    median(peak_force_n) AS peak_median_n,
    quantile_cont(peak_force_n, 0.99) AS peak_99_percent_n,
    max(peak_force_n) AS peak_max_n
FROM 'runs.parquet';

-- The worst runs first: each is run again by its seed.
SELECT run, seed, peak_force_n, digest FROM 'runs.parquet' ORDER BY peak_force_n DESC, run LIMIT 5;
