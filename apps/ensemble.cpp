#include "ensemble/ensemble.hpp"

#include <fmt/format.h>

#include <cmath>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "base/error.hpp"
#include "base/files.hpp"
#include "base/parallel.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "ensemble/gather.hpp"
#include "jobs/shards.hpp"

namespace pliant::apps {

namespace {

namespace fs = std::filesystem;

constexpr int usual_members = 1000;
constexpr std::size_t failures_told = 10;

struct Arguments {
  std::string model, from = "posterior", out, points, shard;
  int members = 0, chunk = 25, workers = 0, threads = 1, job = 0;
  std::optional<std::uint32_t> seed;
  bool no_surface = false, dry_run = false;
};

/// All that a process of an ensemble knows.
struct Ensemble {
  fs::path model_file;
  Model model;
  std::optional<EnsembleScene> scene;
  EnsemblePlan plan;
};

/// The file of a model, by its own name or its folder's.
fs::path model_file_of(const std::string& name) {
  return is_folder(name) ? fs::path(name) / "model.toml" : fs::path(name);
}

/// Materials of the rows of a table; of all, or of the first so many.
std::vector<DrawnMaterial> materials_of_table(const Arguments& arguments, const Model& model) {
  std::vector<DrawnMaterial> materials = read_materials(arguments.from, material_of(model));
  if (arguments.members > int(materials.size()))
    throw InputError({{arguments.from},
                      fmt::format("{} rows for {} members", materials.size(), arguments.members),
                      "a row a member",
                      "leave --members out: all rows are taken"});
  if (arguments.members > 0) materials.resize(std::size_t(arguments.members));
  return materials;
}

/// @return  with where they come from, in words
std::pair<std::vector<DrawnMaterial>, std::string> materials_of(const Arguments& arguments, const Ensemble& ensemble) {
  const bool is_posterior = arguments.from == "posterior";
  if (!is_posterior && arguments.from != "prior") {
    if (!is_file(arguments.from))
      throw InputError({{arguments.from}, why_no_file(arguments.from), "--from posterior, prior or a CSV file", ""});
    if (arguments.seed)
      throw InputError({{}, "--seed with a CSV file, of which nothing is drawn", "--from posterior or prior", ""});
    return {materials_of_table(arguments, ensemble.model), "a table"};
  }
  const fs::path file = ensemble.model_file.parent_path() / "result.json";
  const Result result = read_result(file);
  const int members = arguments.members > 0 ? arguments.members : usual_members;
  const unsigned seed = arguments.seed.value_or(1);
  return {is_posterior ? posterior_samples(result, members, seed, file) : prior_samples(result, members, seed, file),
          fmt::format("the {} (seed {})", arguments.from, seed)};
}

Ensemble read_ensemble(const Arguments& arguments) {
  Ensemble ensemble;
  ensemble.model_file = model_file_of(arguments.model);
  ensemble.model = load_model(ensemble.model_file);
  auto [materials, source] = materials_of(arguments, ensemble);
  EnsembleQuestion question;
  if (!arguments.points.empty()) question.points = read_marker_positions(arguments.points);
  question.keeps_surface = !arguments.no_surface;
  ensemble.scene.emplace(ensemble.model, std::move(question), arguments.points);
  ensemble.plan = plan_ensemble(ensemble.model, ensemble.model_file, *ensemble.scene, std::move(materials),
                                std::move(source), arguments.chunk, PLIANT_VERSION " " PLIANT_COMMIT);
  return ensemble;
}

/// What a process of its own does for the others: one chunk.
int run_job(const Arguments& arguments) {
  const ThreadLimit threads(std::max(1, arguments.threads));
  const Ensemble ensemble = read_ensemble(arguments);
  if (arguments.job > int(ensemble.plan.chunks.size()))
    throw InputError({{}, fmt::format("--job {}", arguments.job), "a chunk of the ensemble", ""});
  simulate_chunk(arguments.out, *ensemble.scene, ensemble.plan, std::size_t(arguments.job - 1),
                 [] { return is_interrupted(); });
  return Fine;
}

std::vector<std::string> words_of(const Arguments& arguments, std::size_t chunk, int threads) {
  std::vector<std::string> words = own_program();
  words.insert(words.end(), {"ensemble", arguments.model, "--from", arguments.from, "--out", arguments.out, "--chunk",
                             std::to_string(arguments.chunk), "--job", std::to_string(chunk + 1), "--threads",
                             std::to_string(threads)});
  if (arguments.members > 0) words.insert(words.end(), {"--members", std::to_string(arguments.members)});
  if (arguments.seed) words.insert(words.end(), {"--seed", std::to_string(*arguments.seed)});
  if (!arguments.points.empty()) words.insert(words.end(), {"--points", arguments.points});
  if (arguments.no_surface) words.emplace_back("--no-surface");
  return words;
}

std::string spoken_bytes(double bytes) {
  return bytes < 1e9 ? fmt::format("{:.0f} MB", std::ceil(1e-6 * bytes)) : fmt::format("{:.1f} GB", 1e-9 * bytes);
}

std::string spoken_time(double seconds) {
  if (seconds < 100.0) return fmt::format("{:.2g} s", seconds);
  return seconds < 6000.0 ? fmt::format("{:.0f} min", seconds / 60.0) : fmt::format("{:.1f} h", seconds / 3600.0);
}

/// Processor time that this process has used [s].
double processor_seconds() { return double(std::clock()) / CLOCKS_PER_SEC; }

int workers_of(const Arguments& arguments) {
  const int processors = std::max(1, int(std::thread::hardware_concurrency()));
  return arguments.workers > 0 ? arguments.workers : std::max(1, processors / arguments.threads);
}

/// Says what would be done, and how long it takes by one member that is simulated for that.
int run_dry(const Arguments& arguments, const Ensemble& ensemble, double setup_seconds,
            const std::vector<std::size_t>& own) {
  const EnsemblePlan& plan = ensemble.plan;
  int open = 0, open_chunks = 0;
  std::optional<std::size_t> first;
  for (const std::size_t k : own) {
    if (is_whole(chunks_of(arguments.out), plan.chunks[k], plan.shape)) continue;
    open += plan.chunks[k].members, ++open_chunks;
    if (!first) first = k;
  }
  std::cout << fmt::format("{} members in {} chunks; {} members in {} chunks are left to this part\n", plan.members(),
                           plan.chunks.size(), open, open_chunks);
  std::cout << fmt::format("{} of paths and figures in {} when all are there\n", spoken_bytes(plan.bytes()),
                           chunks_of(arguments.out).string());
  if (!first) return Fine;
  const double begin = processor_seconds();
  (void)ensemble.scene->simulate(plan.materials[std::size_t(plan.chunks[*first].first)],
                                 [] { return is_interrupted(); });
  const double seconds = processor_seconds() - begin, all = seconds * open + setup_seconds * open_chunks;
  std::cout << fmt::format(
      "a member takes {:.2g} s of a core here (member {} was simulated), a chunk {:.2g} s beside "
      "them:\npredicted: {} of core time, {} by {} workers of one core each\n",
      seconds, plan.chunks[*first].first + 1, setup_seconds, spoken_time(all), spoken_time(all / workers_of(arguments)),
      workers_of(arguments));
  return Fine;
}

void simulate_chunks(const Arguments& arguments, const Ensemble& ensemble, const std::vector<std::size_t>& own) {
  ProcessOptions options;
  options.claims = fs::path(arguments.out) / "claims";
  options.workers = workers_of(arguments), options.threads = arguments.threads;
  options.interrupted = [] { return is_interrupted(); };
  int ended = 0;
  std::vector<std::unique_ptr<Job>> jobs;
  for (const std::size_t k : own)
    jobs.push_back(chunk_job(
        arguments.out, ensemble.plan, k, [&arguments, k](int threads) { return words_of(arguments, k, threads); },
        [&ended, total = int(own.size())] { show_progress("chunks", ++ended, total); }));
  (void)run_processes(jobs, options);
}

/// Names the members that failed.
int say_failures(const Arguments& arguments, const EnsemblePlan& plan) {
  const std::vector<FailedMember> failed = failed_members(arguments.out, plan);
  for (std::size_t i = 0; i < std::min(failed.size(), failures_told); ++i)
    std::cerr << fmt::format("member {} failed: {}\n", failed[i].number, failed[i].reason);
  if (failed.size() > failures_told)
    std::cerr << fmt::format("and {} more, in {}/members.csv\n", failed.size() - failures_told, arguments.out);
  return int(failed.size());
}

int run(const Arguments& arguments) {
  if (arguments.job > 0) return run_job(arguments);
  const double begin = processor_seconds();
  std::optional<ThreadLimit> one_thread;
  if (arguments.dry_run) one_thread.emplace(1);
  const Ensemble ensemble = read_ensemble(arguments);
  const EnsemblePlan& plan = ensemble.plan;
  const double setup_seconds = processor_seconds() - begin;
  std::vector<std::size_t> all;
  for (std::size_t k = 0; k < plan.chunks.size(); ++k) all.push_back(k);
  const std::vector<std::size_t> own = shard_of(all, shard_named(arguments.shard));
  if (arguments.dry_run) return run_dry(arguments, ensemble, setup_seconds, own);
  make_folder(arguments.out);
  simulate_chunks(arguments, ensemble, own);
  remove_messages(arguments.out, plan);
  const int ended = members_ended(arguments.out, plan), failed = say_failures(arguments, plan);
  std::cout << fmt::format("{} of {} members ended, {} failed\n", ended, plan.members(), failed);
  if (is_interrupted()) return WasInterrupted;
  if (ended < plan.members()) {
    std::cout << "others are with other processes, or in other parts: run the same again to go on or to gather\n";
    return NotConverged;
  }
  const bool is_gathered =
      gather_ensemble(arguments.out, ensemble.model, *ensemble.scene, plan, [](int done, int total) {
        show_progress("frames gathered", done, total);
        return !is_interrupted();
      });
  if (!is_gathered) {
    std::cout << "another process gathers what they say: run the same again to see whether it came to its end\n";
    return NotConverged;
  }
  std::cout << "look at " << (fs::path(arguments.out) / "ensemble.html").string() << "\n";
  return failed == 0 ? Fine : NotConverged;
}

constexpr const char* footer = R"(Materials: Young's modulus, Poisson's ratio and both dampings
  posterior   what the fit left open: result.json beside the model, as by `pliant export --samples`
  prior       what the fit held likely before it saw the recording, where result.json states that
  FILE.csv    a row a member, with columns such as `youngs_modulus [Pa]`; what has no column is the model's

Examples:
  pliant ensemble fit --members 5000 --from posterior --out many --dry-run       how much it is, and how long it takes
  pliant ensemble fit --members 5000 --from posterior --out many
  pliant ensemble fit --members 5000 --out many --shard $SLURM_ARRAY_TASK_ID/50
  pliant ensemble fit --from materials.csv --points tips.csv --out many

Members are simulated as the model's recording was. The folder gets members.csv, quantiles.csv, frames.csv, points.csv,
surface.pvd and ensemble.html once all members ended (docs/ensemble.md). Processes that share the folder share the work; what is
there is not simulated again, more members of the same model go on from it. One that fails stops no other. Exit code 3: some
failed, or are not ended or gathered yet.)";

}  // namespace

void add_ensemble(CommandLine& line, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  Command command = line.add_command("ensemble", "Simulate many members of a fitted model: quantiles of what it does");
  command.option("model", arguments->model, "a fit's folder, or its model.toml").required().type_name("MODEL");
  command.option("--members", arguments->members, "how many; 1000 where left out, or all rows of the CSV file")
      .positive()
      .type_name("N");
  command.option("--from", arguments->from, "where their materials come from: posterior, prior or a CSV file")
      .type_name("SOURCE")
      .show_default();
  command.option("--out,-o", arguments->out, "folder of the ensemble, which all machines share")
      .required()
      .type_name("DIR");
  command
      .option("--points", arguments->points,
              "points of the object (CSV: id,x,y,z at rest) whose paths are told, too: points.csv")
      .type_name("FILE");
  command.flag("--no-surface", arguments->no_surface,
               "do not write the trajectories of the surface's vertices: uses less disk space");
  command.option("--seed", arguments->seed, "of what is drawn; 1 where left out").type_name("N");
  command.option("--workers", arguments->workers, "processes at once on this machine; one a processor where left out")
      .positive()
      .type_name("N");
  command.option("--threads", arguments->threads, "of each process").positive().show_default();
  command.option("--chunk", arguments->chunk, "members that a process simulates one after the other")
      .positive()
      .show_default();
  command.option("--shard", arguments->shard, "this part of the chunks alone, such as 3/50").type_name("PART/PARTS");
  command.flag("--dry-run", arguments->dry_run, "say how much it is and how long it takes, by simulating one member");
  command.option("--job", arguments->job, "simulate this chunk alone, in this process").positive().hidden();
  command.footer(footer);
  command.callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace pliant::apps
