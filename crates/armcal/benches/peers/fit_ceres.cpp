// The fit problem of the bench by Ceres: fit_ceres PROBLEM.txt -> one JSON line.
//
// Derivatives by Jets through a functor of its own; Huber's loss on the norm of a dwell, as Ceres has it; priors by
// NormalPrior. The file: rows, base, tip, dwells, in the order they are read below.
#include <ceres/ceres.h>
#include <ceres/normal_prior.h>
#include <ceres/rotation.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace {

constexpr int kRows = 4;  // DH rows of the paper's arm
constexpr int kBlocks = kRows + 2;  // base, rows, tip

struct Parameter { double nominal, sigma, lower, upper; bool free; };
// Joint readings row by row, 0 where a row has no joint.
struct Dwell { double joint_rad[kRows], measured_m[3], whitener[9]; };

struct Problem {
  double base_rotation[9], huber_c, sigma_scale;
  std::vector<Parameter> blocks[kBlocks];
  std::vector<Dwell> dwells;
};

double Number(std::istream& in) {
  std::string word;
  if (!(in >> word)) { std::fprintf(stderr, "the problem file is too short\n"); std::exit(1); }
  return std::stod(word);  // operator>> does not read "inf"
}

Problem Read(const char* path) {
  std::ifstream in(path);
  Problem p;
  p.huber_c = Number(in);
  p.sigma_scale = Number(in);
  for (double& v : p.base_rotation) v = Number(in);
  for (auto& block : p.blocks) {
    block.resize(static_cast<size_t>(Number(in)));
    for (Parameter& q : block) {
      q.nominal = Number(in); q.sigma = Number(in); q.lower = Number(in); q.upper = Number(in);
      q.free = Number(in) != 0.0;
    }
  }
  p.dwells.resize(static_cast<size_t>(Number(in)));
  for (Dwell& d : p.dwells) {
    for (double& v : d.joint_rad) v = Number(in);
    for (double& v : d.measured_m) v = Number(in);
    for (double& v : d.whitener) v = Number(in);
  }
  return p;
}

// Whitened measured - predicted of one dwell.
struct Tip {
  const Problem* problem;
  const Dwell* dwell;

  template <typename T>
  bool operator()(const T* base, const T* r1, const T* r2, const T* r3, const T* r4, const T* tip, T* out) const {
    const T* rows[kRows] = {r1, r2, r3, r4};
    T at[3] = {tip[0], tip[1], tip[2]};
    for (int i = kRows - 1; i >= 0; --i) {  // theta, d, a, alpha
      const T* row = rows[i];
      const T ca = cos(row[3]), sa = sin(row[3]);
      const T x = at[0] + row[2], y = ca * at[1] - sa * at[2], z = sa * at[1] + ca * at[2] + row[1];
      const T angle = row[0] + dwell->joint_rad[i];
      const T ct = cos(angle), st = sin(angle);
      at[0] = ct * x - st * y; at[1] = st * x + ct * y; at[2] = z;
    }
    T turned[3], off[3];
    ceres::AngleAxisRotatePoint(base + 3, at, turned);
    for (int i = 0; i < 3; ++i) {
      const double* r = problem->base_rotation + 3 * i;
      off[i] = dwell->measured_m[i] - (base[i] + r[0] * turned[0] + r[1] * turned[1] + r[2] * turned[2]);
    }
    for (int i = 0; i < 3; ++i) {
      const double* w = dwell->whitener + 3 * i;
      out[i] = (w[0] * off[0] + w[1] * off[1] + w[2] * off[2]) / problem->sigma_scale;
    }
    return true;
  }
};

double CpuSeconds() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return t.tv_sec + 1e-9 * t.tv_nsec;
}

double Median(std::vector<double> v) {
  std::nth_element(v.begin(), v.begin() + v.size() / 2, v.end());
  return v[v.size() / 2];
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const Problem data = Read(argv[1]);
  std::vector<double> values[kBlocks];
  for (int b = 0; b < kBlocks; ++b) for (const Parameter& q : data.blocks[b]) values[b].push_back(q.nominal);

  ceres::Problem problem;
  for (const Dwell& dwell : data.dwells) {
    auto* cost = new ceres::AutoDiffCostFunction<Tip, 3, 6, 4, 4, 4, 4, 3>(new Tip{&data, &dwell});
    auto* loss = data.huber_c > 0.0 ? new ceres::HuberLoss(data.huber_c) : nullptr;
    problem.AddResidualBlock(cost, loss, values[0].data(), values[1].data(), values[2].data(), values[3].data(),
                             values[4].data(), values[5].data());
  }
  for (int b = 0; b < kBlocks; ++b) {
    const auto& block = data.blocks[b];
    const int n = static_cast<int>(block.size());
    std::vector<int> fixed;
    ceres::Vector nominal(n);
    ceres::Matrix weight = ceres::Matrix::Zero(n, n);
    for (int k = 0; k < n; ++k) {
      nominal[k] = block[k].nominal;
      if (!block[k].free) { fixed.push_back(k); continue; }
      weight(k, k) = 1.0 / block[k].sigma;
      if (block[k].lower > -std::numeric_limits<double>::infinity())
        problem.SetParameterLowerBound(values[b].data(), k, block[k].lower);
      if (block[k].upper < std::numeric_limits<double>::infinity())
        problem.SetParameterUpperBound(values[b].data(), k, block[k].upper);
    }
    if (static_cast<int>(fixed.size()) == n) { problem.SetParameterBlockConstant(values[b].data()); continue; }
    problem.AddResidualBlock(new ceres::NormalPrior(weight, nominal), nullptr, values[b].data());
    if (!fixed.empty()) problem.SetManifold(values[b].data(), new ceres::SubsetManifold(n, fixed));
  }

  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.max_num_iterations = 200;
  options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 1e-12;
  std::vector<double> wall_s, cpu_s;
  ceres::Solver::Summary summary;
  for (int i = 0; i < 101; ++i) {
    for (int b = 0; b < kBlocks; ++b)
      for (size_t k = 0; k < values[b].size(); ++k) values[b][k] = data.blocks[b][k].nominal;
    const auto began = std::chrono::steady_clock::now();
    const double cpu = CpuSeconds();
    ceres::Solve(options, &problem, &summary);
    if (i == 0) continue;  // warm-up
    cpu_s.push_back(CpuSeconds() - cpu);
    wall_s.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count());
  }
  std::printf("[{\"how\": \"%s, Jets, dense normal Cholesky\", \"wall_s\": %.9g, \"cpu_s\": %.9g, \"same_cost\": 1e-9, \"evaluations\": %d, \"values\": [",
              "Levenberg-Marquardt", Median(wall_s), Median(cpu_s), static_cast<int>(summary.iterations.size()));
  const char* comma = "";
  for (const auto& block : values) for (double v : block) { std::printf("%s%.17g", comma, v); comma = ", "; }
  std::printf("], \"version\": \"%s\"}]\n", CERES_VERSION_STRING);
  return summary.IsSolutionUsable() ? 0 : 1;
}
