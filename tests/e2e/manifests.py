# SPDX-License-Identifier: Apache-2.0
"""Checks manifests, field by field, against the models of the published API in Kubernetes' Python client, against each
other, and against the programs' options. manifests.py PROGRAMS FILE...; prints the errors; exit code 1 if there are any.
manifests.py --hook FILE prints the workers' preStop command, one word per line."""
import copy
import re
import subprocess
import sys

import yaml

from kubernetes import client

NAME = re.compile(r"[a-z0-9]([a-z0-9-]{0,61}[a-z0-9])?")
SECRETS = set()  # those created by the commands in the files' comments
QUANTITY = re.compile(r"[0-9]+(\.[0-9]+)?(m|k|M|G|T|Ki|Mi|Gi|Ti)?")


class Loader(yaml.SafeLoader):
    """Reads YAML, and refuses duplicate keys."""

    def construct_mapping(self, node, deep=False):
        keys = [self.construct_object(k, deep=True) for k, _ in node.value]
        for k in keys:
            if keys.count(k) > 1:
                raise yaml.YAMLError("%s: '%s' is given twice" % (node.start_mark, k))
        return super().construct_mapping(node, deep)


def load(files):
    docs = []
    for f in files:
        with open(f) as text:
            docs += list(yaml.load_all(text, Loader))
    return docs


# ---- field by field ----

SIMPLE = {"str": str, "int": int, "bool": bool, "float": (int, float)}


def check_value(value, kind, where, wrong):
    listed = re.fullmatch(r"list\[(.*)\]", kind)
    mapped = re.fullmatch(r"dict[(\[]str, (.*)[)\]]", kind)
    if listed or mapped:
        if not isinstance(value, list if listed else dict):
            wrong.append("%s: not a %s" % (where, "list" if listed else "map"))
            return
        for k, v in enumerate(value) if listed else value.items():
            if mapped and not isinstance(k, str):
                wrong.append("%s: the key %r is no text" % (where, k))
            check_value(v, (listed or mapped).group(1), "%s[%s]" % (where, k), wrong)
    elif kind in SIMPLE:
        if not isinstance(value, SIMPLE[kind]) or (isinstance(value, bool) and kind != "bool"):
            wrong.append("%s: %r is no %s" % (where, value, kind))
    elif kind == "object":  # an integer or a string
        if isinstance(value, bool) or not isinstance(value, (int, str)):
            wrong.append("%s: %r is neither a number nor a text" % (where, value))
    else:
        check_model(value, getattr(client, kind), where, wrong)


def check_model(value, model, where, wrong):
    if not isinstance(value, dict):
        wrong.append("%s: %r is no map" % (where, value))
        return
    names = {published: own for own, published in model.attribute_map.items()}
    given = {}
    for key, v in value.items():
        if key not in names:
            wrong.append("%s: there is no '%s'" % (where, key))
            continue
        given[names[key]] = v
        check_value(v, model.openapi_types[names[key]], where + "." + key, wrong)
    try:
        model(**given)  # refuses missing required fields, and values that are not in a list
    except ValueError as e:
        wrong.append("%s: %s" % (where, e))


def check_fields(docs, wrong):
    for d in docs:
        version, kind = str(d.get("apiVersion")), str(d.get("kind"))
        model = getattr(client, version.split("/")[-1].capitalize() + kind, None)
        if model is None or version not in ("v1", "apps/v1", "policy/v1", "networking.k8s.io/v1"):
            wrong.append("no kind %s of %s" % (kind, version))
        else:
            check_model(d, model, kind, wrong)


# ---- one document against another ----

def dig(value, *keys, default=None):
    for k in keys:
        value = value.get(k) if isinstance(value, dict) else None
    return default if value is None else value


def matches(selector, labels):
    return bool(selector) and all(labels.get(k) == v for k, v in selector.items())


def check_tls(where, pod, c, docs, wrong):
    """HSLT_TLS must name a Secret that is required and readable by the pod's group only."""
    if "--insecure" in c["args"]:
        wrong.append("%s: is insecure" % where)
    settings = {}
    for r in c.get("envFrom", []):
        for m in find(docs, "ConfigMap", r["configMapRef"]["name"]):
            settings.update(m["data"])
    at = [m for m in c.get("volumeMounts", []) if m["mountPath"] == settings.get("HSLT_TLS")]
    secrets = [v["secret"] for v in pod.get("volumes", []) if at and v["name"] == at[0]["name"] and "secret" in v]
    if len(secrets) != 1 or at[0].get("readOnly") is not True:
        wrong.append("%s: HSLT_TLS is no Secret" % where)
        return
    mode = secrets[0].get("defaultMode", 0o644)
    if mode & 0o337 or not mode & 0o040 or not pod["securityContext"].get("fsGroup"):
        wrong.append("%s: the key has the mode %o" % (where, mode))
    if secrets[0].get("optional"):
        wrong.append("%s: starts without TLS" % where)
    if secrets[0]["secretName"] not in SECRETS:
        wrong.append("%s: nobody says how to make the Secret %s" % (where, secrets[0]["secretName"]))


def check_pod(d, docs, options, wrong):
    name = dig(d, "metadata", "name")
    pod = dig(d, "spec", "template", "spec")
    labels = dig(d, "spec", "template", "metadata", "labels", default={})
    if not matches(dig(d, "spec", "selector", "matchLabels"), labels):
        wrong.append("%s: its selector does not match its pods" % name)
    volumes = [v["name"] for v in pod.get("volumes", [])]
    volumes += [v["metadata"]["name"] for v in d["spec"].get("volumeClaimTemplates", [])]
    safe = pod.get("securityContext", {})
    if not safe.get("runAsNonRoot") or dig(safe, "seccompProfile", "type") != "RuntimeDefault":
        wrong.append("%s: its pods are not restricted" % name)
    for c in pod["containers"]:
        where = "%s/%s" % (name, c["name"])
        mounted = [m["name"] for m in c.get("volumeMounts", [])]
        if sorted(mounted) != sorted(volumes):
            wrong.append("%s: mounts %s of the volumes %s" % (where, mounted, volumes))
        safe = c.get("securityContext", {})
        if safe.get("allowPrivilegeEscalation") is not False or dig(safe, "capabilities", "drop") != ["ALL"]:
            wrong.append("%s: is not restricted" % where)
        check_tls(where, pod, c, docs, wrong)
        for r in c.get("envFrom", []):
            if not find(docs, "ConfigMap", r["configMapRef"]["name"]):
                wrong.append("%s: no ConfigMap %s" % (where, r["configMapRef"]["name"]))
        words = c["args"]
        for w in words:
            if w.startswith("--") and w not in options(c["command"][0]):
                wrong.append("%s: %s has no %s" % (where, c["command"][0], w))
            for v in re.findall(r"\$\((\w+)\)", w):
                if v not in [e["name"] for e in c.get("env", [])]:
                    wrong.append("%s: no variable %s" % (where, v))
        ports = [p["name"] for p in c.get("ports", [])]
        for probe in ("startupProbe", "readinessProbe", "livenessProbe"):
            port = dig(c, probe, "tcpSocket", "port")
            if port is not None and port not in ports:
                wrong.append("%s: %s of no port %s" % (where, probe, port))
        for kind in ("requests", "limits"):
            for k, v in dig(c, "resources", kind, default={}).items():
                if not QUANTITY.fullmatch(v):
                    wrong.append("%s: %s of %s is %s" % (where, kind, k, v))
        if "--grace" in words and int(words[words.index("--grace") + 1]) + 10 > pod["terminationGracePeriodSeconds"]:
            wrong.append("%s: has no time for its grace" % where)


def find(docs, kind, name):
    return [d for d in docs if d["kind"] == kind and d["metadata"]["name"] == name]


def check_sense(docs, options, wrong):
    pods = [d for d in docs if d["kind"] in ("StatefulSet", "Deployment")]
    namespaces = [d["metadata"]["name"] for d in docs if d["kind"] == "Namespace"]
    seen = set()
    for d in docs:
        name = d["metadata"]["name"]
        if not NAME.fullmatch(name) or (d["kind"], name) in seen:
            wrong.append("%s '%s': no name, or there twice" % (d["kind"], name))
        seen.add((d["kind"], name))
        if d["kind"] != "Namespace" and d["metadata"].get("namespace") not in namespaces:
            wrong.append("%s: is in no namespace of these" % name)
    for d in pods:
        check_pod(d, docs, options, wrong)
        if d["kind"] == "StatefulSet" and not find(docs, "Service", d["spec"]["serviceName"]):
            wrong.append("no Service %s" % d["spec"]["serviceName"])

    def chosen(selector):
        return [p for p in pods if matches(selector, dig(p, "spec", "template", "metadata", "labels", default={}))]

    for d in docs:
        name = d["metadata"]["name"]
        if d["kind"] == "PodDisruptionBudget" and len(chosen(dig(d, "spec", "selector", "matchLabels"))) != 1:
            wrong.append("PodDisruptionBudget %s: for %d" % (name, len(chosen(dig(d, "spec", "selector", "matchLabels")))))
        if d["kind"] == "NetworkPolicy":
            peers = [f["podSelector"]["matchLabels"] for i in d["spec"]["ingress"] for f in i["from"]]
            if len(chosen(dig(d, "spec", "podSelector", "matchLabels"))) != 1 or not all(map(chosen, peers)):
                wrong.append("NetworkPolicy %s: selects nobody, or lets nobody in" % name)
    check_port(docs, chosen, wrong)
    for p in pods:
        if not [d for d in docs if d["kind"] == "PodDisruptionBudget" and p in chosen(dig(d, "spec", "selector", "matchLabels"))]:
            wrong.append("%s: no PodDisruptionBudget" % p["metadata"]["name"])
        if p["kind"] == "Deployment" and not dig(p["spec"]["template"]["spec"]["containers"][0], "lifecycle", "preStop", "exec", "command"):
            wrong.append("%s: no preStop hook" % p["metadata"]["name"])


def check_port(docs, chosen, wrong):
    """One port must be named everywhere: by the coordinator, its container, the service, the policy, and the workers."""
    service = [d for d in docs if d["kind"] == "Service"][0]
    behind = chosen(service["spec"]["selector"])
    if len(behind) != 1:
        wrong.append("the Service is for %d" % len(behind))
        return
    c = behind[0]["spec"]["template"]["spec"]["containers"][0]
    port = service["spec"]["ports"][0]
    ports = {int(c["args"][c["args"].index("--listen") + 1].rsplit(":", 1)[1]), port["port"]}
    ports |= {p["containerPort"] for p in c["ports"] if p["name"] == port["targetPort"]}
    ports |= {p["port"] for d in docs if d["kind"] == "NetworkPolicy" for i in d["spec"]["ingress"] for p in i["ports"]}
    called = [d["data"]["HSLT_COORDINATOR"] for d in docs if d["kind"] == "ConfigMap"]
    if len(ports) != 1 or called != ["%s:%d" % (service["metadata"]["name"], port["port"])]:
        wrong.append("ports %s, called %s" % (sorted(ports), called))


def verdict(docs, options):
    wrong = []
    try:
        check_fields(docs, wrong)
        check_sense(docs, options, wrong)
    except (KeyError, TypeError, AttributeError, IndexError, ValueError) as e:
        wrong.append("something is missing: %r" % e)
    return wrong


# ---- faults that must be found ----

def faults(docs):
    """Returns functions that each change a copy of the documents in one place."""
    def one(kind, name):
        return lambda ds: find(ds, kind, name)[0]

    coordinator, worker = one("StatefulSet", "hslt-coordinator"), one("Deployment", "hslt-worker")
    service, budget, policy = one("Service", "hslt-coordinator"), one("PodDisruptionBudget", "hslt-worker"), one("NetworkPolicy", "hslt-coordinator")

    def pod(d):
        return d["spec"]["template"]["spec"]

    def box(d):
        return pod(d)["containers"][0]

    return [
        ("an unknown field", lambda ds: worker(ds)["spec"].update(replica=3)),
        ("a text for a number", lambda ds: worker(ds)["spec"].update(replicas="ten")),
        ("a number for a text", lambda ds: box(worker(ds))["resources"]["limits"].update(cpu=4)),
        ("a truth for a number", lambda ds: pod(worker(ds)).update(terminationGracePeriodSeconds=True)),
        ("a deep unknown field", lambda ds: box(worker(ds))["lifecycle"]["preStop"].update(run="x")),
        ("a missing selector", lambda ds: coordinator(ds)["spec"].pop("selector")),
        ("a missing container name", lambda ds: box(worker(ds)).pop("name")),
        ("an unknown kind", lambda ds: budget(ds).update(apiVersion="policy/v2")),
        ("a list that is none", lambda ds: pod(worker(ds)).update(volumes={"name": "x"})),
        ("another label", lambda ds: worker(ds)["spec"]["template"]["metadata"]["labels"].pop("app.kubernetes.io/name")),
        ("a peer without its label", lambda ds: worker(ds)["spec"]["template"]["metadata"]["labels"].pop("hslt-peer")),
        ("a budget for nobody", lambda ds: budget(ds)["spec"]["selector"]["matchLabels"].update(a="b")),
        ("a volume of no name", lambda ds: box(worker(ds))["volumeMounts"][0].update(name="x")),
        ("an unknown option", lambda ds: box(worker(ds))["args"].append("--fast")),
        ("an unknown variable", lambda ds: box(worker(ds))["env"].pop()),
        ("a grace without time", lambda ds: pod(worker(ds)).update(terminationGracePeriodSeconds=25)),
        ("root", lambda ds: pod(coordinator(ds))["securityContext"].pop("runAsNonRoot")),
        ("a service at another port", lambda ds: service(ds)["spec"]["ports"][0].update(port=7701)),
        ("a policy for another port", lambda ds: policy(ds)["spec"]["ingress"][0]["ports"][0].update(port=80)),
        ("another namespace", lambda ds: service(ds)["metadata"].update(namespace="other")),
        ("no such service", lambda ds: coordinator(ds)["spec"].update(serviceName="x")),
        ("no hook", lambda ds: box(worker(ds)).pop("lifecycle")),
        ("no encryption", lambda ds: box(coordinator(ds))["args"].append("--insecure")),
        ("certificates elsewhere", lambda ds: find(ds, "ConfigMap", "hslt-farm")[0]["data"].update(HSLT_TLS="/etc/tls")),
        ("no certificates", lambda ds: find(ds, "ConfigMap", "hslt-farm")[0]["data"].pop("HSLT_TLS")),
        ("a key for everybody", lambda ds: pod(worker(ds))["volumes"][0]["secret"].update(defaultMode=0o444)),
        ("a key for root alone", lambda ds: pod(worker(ds))["volumes"][0]["secret"].update(defaultMode=0o400)),
        ("a key by default", lambda ds: pod(worker(ds))["volumes"][0]["secret"].pop("defaultMode")),
        ("a Secret that may be missing", lambda ds: pod(coordinator(ds))["volumes"][0]["secret"].update(optional=True)),
        ("a Secret that nobody makes", lambda ds: pod(coordinator(ds))["volumes"][0]["secret"].update(secretName="x")),
        ("no budget", lambda ds: ds.remove(budget(ds))),
    ]


def main(argv):
    if argv[1] == "--hook":
        for d in load(argv[2:]):
            if d["kind"] == "Deployment":
                print("\n".join(d["spec"]["template"]["spec"]["containers"][0]["lifecycle"]["preStop"]["exec"]["command"]))
        return 0
    known = {}
    for f in argv[2:]:
        with open(f) as text:
            SECRETS.update(re.findall(r"create secret generic ([a-z-]+) --from-file=", text.read()))

    def options(program):
        if program not in known:
            text = subprocess.run([argv[1] + "/" + program, "--help"], stdout=subprocess.PIPE, check=True).stdout.decode()
            known[program] = set(re.findall(r"--[a-z-]+", text))
        return known[program]

    docs = load([f for f in argv[2:] if f.endswith(".yaml")])
    wrong = verdict(docs, options)
    for name, change in faults(docs):
        copies = copy.deepcopy(docs)
        change(copies)
        if not verdict(copies, options):
            wrong.append("not found: " + name)
    print("\n".join(wrong) if wrong else "%d objects are right, %d faults were found" % (len(docs), len(faults(docs))))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv))
