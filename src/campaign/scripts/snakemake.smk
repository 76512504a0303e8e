# snakemake --cores all, or with a profile of your cluster.

FOLDER = @PYTHON_FOLDER@
SHARDS = range(1, @SHARDS@ + 1)


rule gather:
    input:
        expand("shard-{shard}.done", shard=SHARDS),
    params:
        folder=FOLDER,
    shell:
        "misclosure campaign gather {params.folder:q}"


rule shard:
    output:
        touch("shard-{shard}.done"),
    params:
        folder=FOLDER,
    threads: @JOBS@
    shell:
        "misclosure campaign run {params.folder:q} --shard {wildcards.shard}/@SHARDS@ --jobs {threads}"
