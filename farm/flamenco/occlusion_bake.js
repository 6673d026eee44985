// A bake in items as a job type of Flamenco 3: plan, bake side by side, merge. Put it into the `scripts` folder beside the
// Manager; docs/farm.md tells the rest.

const JOB_TYPE = {
    label: "Occlusion Bake",
    description: "Bake ambient and reflection occlusion of all objects that render",
    settings: [
        { key: "output", type: "string", subtype: "dir_path", required: true, default: "/render/textures",
          eval: "bpy.path.abspath('//textures')", evalInfo: { showLinkButton: true, description: "Beside the file" },
          description: "Folder for the images, where all workers see it" },
        { key: "options", type: "string", default: "--maps ao",
          description: "Options of the bake, as of the command: --maps ao ro --size 2048 --distance 2 --atlas \"My Atlas\"" },
        { key: "tasks", type: "int32", default: 10,
          description: "How many tasks the objects are shared out to; each starts Blender once" },
        { key: "blendfile", type: "string", required: true, visible: "web", description: "What is baked" },
    ],
};

function compileJob(job) {
    const settings = job.settings;
    const manifest = path.join(settings.output, "manifest.json");
    const count = Math.max(settings.tasks, 1);

    const plan = taskOf("plan", [settings.blendfile], [
        "plan", ...words(settings.options), "--output", settings.output, "--manifest", manifest,
    ]);
    job.addTask(plan);

    const merge = taskOf("merge", [], ["merge", manifest]);
    for (let number = 1; number <= count; number++) {
        const bake = taskOf(`bake ${number} of ${count}`, [], [
            "--manifest", manifest, "--items", `${number}/${count}`, "--progress", "flamenco",
        ]);
        bake.addDependency(plan);
        merge.addDependency(bake);
        job.addTask(bake);
    }
    job.addTask(merge);
}

// A task that runs the extension's command in Blender. Without a shell, so that a cancel reaches it.
function taskOf(name, files, args) {
    const task = author.Task(name, "blender");
    task.addCommand(author.Command("exec", {
        exe: "{blender}",
        args: ["--background", ...files, "--command", "occlusion_bake", ...args],
    }));
    return task;
}

// The words of a line; those in double quotes are one.
function words(line) {
    return (line.match(/"[^"]*"|[^\s"]+/g) || []).map((word) => word.replace(/^"|"$/g, ""));
}
