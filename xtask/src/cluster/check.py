"""Tries the parts of the examples for clusters that are no programs: the Kubernetes job and the summary in SQL."""

import csv
import os
import subprocess
import sys


def kubernetes(path, folder, seeds, shares):
    """Runs the job's shell as each of its pods would, here."""
    import yaml

    with open(path) as file:
        job = yaml.safe_load(file)
    assert (job["apiVersion"], job["kind"]) == ("batch/v1", "Job")
    spec = job["spec"]
    assert spec["completionMode"] == "Indexed" and spec["template"]["spec"]["restartPolicy"] == "Never"
    (container,) = spec["template"]["spec"]["containers"]
    named = {variable["name"]: variable["value"] for variable in container["env"]}
    assert int(named["SHARES"]) == spec["completions"], "there is a pod for each share"
    (mount,) = container["volumeMounts"]
    assert mount["mountPath"] == named["DIR"]
    assert mount["name"] in [volume["name"] for volume in spec["template"]["spec"]["volumes"]]
    named |= {"DIR": folder, "SEEDS": seeds, "SHARES": shares}
    for index in range(int(shares)):
        pod = os.environ | named | {"JOB_COMPLETION_INDEX": str(index)}
        subprocess.run(container["command"] + container["args"], env=pod, check=True)


def summary(path, folder):
    """Runs the statements in a sweep's folder, and compares the spread with the sweep's own."""
    import duckdb

    with open(path) as file:
        text = file.read()
    os.chdir(folder)
    connection = duckdb.connect()
    rows = []
    for statement in duckdb.extract_statements(text):
        answer = connection.execute(statement)
        if statement.type == duckdb.StatementType.SELECT:
            names = [column[0] for column in answer.description]
            rows.append([dict(zip(names, row)) for row in answer.fetchall()])
    (spread,), worst = rows
    with open("summary.csv") as file:
        own = next(row for row in csv.DictReader(file) if row["metric"] == "peak_force_n")
    for ours, theirs in (("min", "min"), ("median", "median"), ("max", "max")):
        assert abs(float(own[ours]) - spread[f"peak_{theirs}_n"]) < 1e-12, (own, spread)
    assert int(own["runs"]) == spread["runs"] and float(own["passed_percent"]) == spread["passed_percent"]
    assert worst[0]["peak_force_n"] == spread["peak_max_n"]
    print(spread)


{"kubernetes": kubernetes, "summary": summary}[sys.argv[1]](*sys.argv[2:])
