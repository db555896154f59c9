!! Whirl of large unreduced rotors: the eigenvalues nearest to 0 at a speed, from banded matrices.
module razy_rotor_whirl_banded
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_eigen_decay, only: forms_t
   use razy_eigen_disc, only: disc_t
   use razy_eigen_spectrum, only: new_spectrum, spectrum_t
   use razy_linalg_band_matrix, only: band_t, complex_band_lu_t, negative_eigenvalues, new_band
   use razy_linalg_banded, only: bandwidth, narrow_order
   use razy_linalg_dense, only: rising_order
   use razy_linalg_lapack, only: dpbtrf, dtbmv, dtbsv
   use razy_linalg_sparse, only: add_matrices, csr_t, entries_t, new_csr
   use razy_rotor_model, only: rotor_model_t
   use razy_linalg_speed_table, only: speed_table_t, table_change
   use razy_rotor_whirl_family, only: whirl_family_t
   use razy_rotor_whirl_modes, only: reference_shift
   use razy_rotor_whirl_unstable, only: unstable_radius
   use razy_rotor_whirl_whirl, only: equal
   implicit none(type, external)
   private

   public :: banded_whirl_t, new_banded_whirl, serves

   !> Models with more coordinates are banded, if the band is narrower than the second share of them and no more than the third
   !> share of the modes is wanted.
   integer, parameter :: most_dense = 120
   real(wp), parameter :: widest = 0.2_wp, most_wanted = 0.3_wp
   !> The least s of `banded_whirl_t`, a frequency squared, over the largest one.
   real(wp), parameter :: least_share = 1.0e-6_wp
   !> σ of the eigenproblems over a frequency of the size of the lowest.
   real(wp), parameter :: share = 0.1_wp

   !> A bearing with a table: v and w of its node are coordinates `at`, 0 if held.
   type :: tabled_t
      type(speed_table_t) :: table
      real(wp) :: ratio = 1.0_wp
      integer :: at(2) = 0
   end type tabled_t

   !> Matrices of the model in the order `order` of its coordinates. Spectra have at least the `least` lowest modes; shapes are
   !> Lᵀ x, L Lᵀ = K + s M.
   type, extends(whirl_family_t) :: banded_whirl_t
      integer :: least = 0
      integer, allocatable, private :: order(:)
      type(band_t), private :: gyroscopic, damping, stiffness, cross_stiffness, circulation
      type(tabled_t), allocatable, private :: tabled(:)
      !> L in LAPACK's form of a lower band.
      real(wp), allocatable, private :: metric(:, :)
      type(disc_t), private :: disc
   contains
      procedure :: solve
      procedure :: shape_of
      procedure :: vector_of
      procedure :: shape_from
      procedure :: newton
      procedure :: forms_of
      procedure, private :: damping_at
      procedure, private :: stiffness_at
   end type banded_whirl_t

contains

   !> Whether the banded method is for a model, of which the `least` lowest modes and all up to `radius`, rad/s, are wanted.
   function serves(model, meshed, least, radius)
      type(rotor_model_t), intent(in) :: model
      logical, intent(in) :: meshed
      integer, intent(in) :: least
      real(wp), intent(in) :: radius
      logical :: serves

      type(csr_t) :: pattern, stiffness
      integer, allocatable :: order(:)

      associate (n => model%numbering%n)
         serves = n > most_dense .and. least <= most_wanted*n .and. radius < huge(radius)
         if (.not. serves) return
         call order_of(model, meshed, stiffness, order, pattern)
         serves = bandwidth(pattern) < widest*n
         if (serves) serves = negative_eigenvalues(add_matrices(1.0_wp, stiffness, -radius**2, model%mass)) <= most_wanted*n
      end associate
   end function serves

   !> The closed stiffness, or the open one, and an order of the coordinates in which all matrices are in a narrow band, with the
   !> `pattern` of all of them in it.
   subroutine order_of(model, meshed, stiffness, order, pattern)
      type(rotor_model_t), intent(in) :: model
      logical, intent(in) :: meshed
      type(csr_t), intent(out) :: stiffness, pattern
      integer, allocatable, intent(out) :: order(:)

      type(entries_t) :: entries
      integer :: i

      stiffness = model%stiffness
      if (meshed) stiffness = model%closed_stiffness()
      call add_pattern(entries, stiffness)
      call add_pattern(entries, model%mass)
      call add_pattern(entries, model%gyroscopic)
      call add_pattern(entries, model%damping)
      call add_pattern(entries, model%circulatory)
      call add_pattern(entries, model%cross_stiffness)
      call add_pattern(entries, model%cross_damping)
      do i = 1, size(model%rotor%bearing)
         associate (bearing => model%rotor%bearing(i))
            associate (at => model%numbering%ends(bearing))
               if (allocated(bearing%table)) call entries%add_block(at(2:3), reshape([1.0_wp, 1.0_wp, 1.0_wp, 1.0_wp], [2, 2]))
            end associate
         end associate
      end do
      pattern = new_csr(entries, model%numbering%n, model%numbering%n)
      order = narrow_order(pattern)
      pattern = pattern%extract(order)
   end subroutine order_of

   subroutine add_pattern(entries, matrix)
      type(entries_t), intent(inout) :: entries
      type(csr_t), intent(in) :: matrix

      type(csr_t) :: positive

      positive = matrix
      positive%value = 1.0_wp
      call entries%add_matrix(1.0_wp, positive)
   end subroutine add_pattern

   !> The problem of an unreduced model, with G, C and damping if they act; with `meshed` all meshes are closed and linear. Of the
   !> `free` rigid motions that no stiffness holds, those of `untouched` (n, r) are left out.
   function new_banded_whirl(model, meshed, gyroscopic, circulatory, damped, free, untouched, error) result(problem)
      type(rotor_model_t), intent(in) :: model
      logical, intent(in) :: meshed, gyroscopic, circulatory, damped
      integer, intent(in) :: free
      real(wp), intent(in) :: untouched(:, :)
      type(error_t), allocatable, intent(out) :: error
      type(banded_whirl_t) :: problem

      type(csr_t) :: damping, pattern, stiffness
      integer :: info, width

      problem%circulatory = circulatory .and. damped
      problem%damped = damped
      call order_of(model, meshed, stiffness, problem%order, pattern)
      width = bandwidth(pattern)
      damping = model%damping
      if (meshed) damping = model%closed_damping()
      associate (order => problem%order, disc => problem%disc, n => model%numbering%n)
         problem%stiffness = new_band(stiffness, order, width)
         problem%damping = new_band(add_matrices(1.0_wp, damping, 1.0_wp, model%cross_damping), order, width)
         problem%gyroscopic = new_band(model%gyroscopic, order, width)
         if (.not. gyroscopic) problem%gyroscopic%entry = 0.0_wp
         problem%cross_stiffness = new_band(model%cross_stiffness, order, width)
         problem%circulation = new_band(model%circulatory, order, width)
         disc%mass = new_band(model%mass, order, width)
         disc%scale = sqrt(reference_shift(model))
         disc%shift = share*disc%scale
         problem%largest = sqrt(2*abs(problem%stiffness%entry(width + 1, :))/disc%mass%entry(width + 1, :))
         call share_in_parts(problem%largest, pattern)
         call find_metric(problem, info)
         if (info /= 0) call raise(error, "an eigenproblem could not be solved")
         problem%untouched = size(untouched, 2)
         call take_rigid(disc, untouched(order, :))
         call find_tables(problem, model)
         disc%gyroscopic = unstable_radius(model, [0.0_wp], .false.) < huge(1.0_wp) .and. free == problem%untouched &
                           .and. .not. damped .and. size(problem%tabled) == 0
      end associate
   end function new_banded_whirl

   !> Let numbers (n) be the largest of their part of the machine: parts follow one another in the order of `pattern`.
   pure subroutine share_in_parts(number, pattern)
      real(wp), intent(inout) :: number(:)
      type(csr_t), intent(in) :: pattern

      integer :: first, i, last

      first = 1
      last = 0
      do i = 1, size(number)
         last = max(last, maxval(pattern%column(pattern%start(i):pattern%start(i + 1) - 1)))
         if (i < last) cycle
         number(first:i) = maxval(number(first:i))
         first = i + 1
      end do
   end subroutine share_in_parts

   !> L; s is raised from a share of the largest frequency, as little as rounding and bearings of negative stiffness allow.
   !> `info` is 0 if that is enough.
   subroutine find_metric(problem, info)
      type(banded_whirl_t), intent(inout) :: problem
      integer, intent(out) :: info

      real(wp) :: s

      s = least_share*maxval(problem%largest)
      associate (width => problem%stiffness%width, n => size(problem%order), mass => problem%disc%mass%entry)
         do
            problem%metric = problem%stiffness%entry(width + 1:, :) + s**2*mass(width + 1:, :)
            call dpbtrf("L", n, width, problem%metric, width + 1, info)
            if (info == 0 .or. s > maxval(problem%largest)) exit
            s = 10*s
         end do
      end associate
   end subroutine find_metric

   !> Make rigid motions (n, r) orthonormal in the metric of the mass, one after the other, twice because once leaves rounding
   !> behind.
   subroutine take_rigid(disc, motion)
      type(disc_t), intent(inout) :: disc
      real(wp), intent(in) :: motion(:, :)

      integer :: i, pass

      disc%rigid = motion
      disc%momentum = 0.0_wp*motion
      do i = 1, size(motion, 2)
         do pass = 1, 2
            associate (own => disc%rigid(:, i))
               own = own - matmul(disc%rigid(:, :i - 1), matmul(own, disc%momentum(:, :i - 1)))
               disc%momentum(:, i) = 0.0_wp
               call disc%mass%add_times(own, disc%momentum(:, i))
               associate (length => sqrt(dot_product(own, disc%momentum(:, i))))
                  own = own/length
                  disc%momentum(:, i) = disc%momentum(:, i)/length
               end associate
            end associate
         end do
      end do
   end subroutine take_rigid

   subroutine find_tables(problem, model)
      type(banded_whirl_t), intent(inout) :: problem
      type(rotor_model_t), intent(in) :: model

      integer :: i, place(0:size(problem%order))

      place(0) = 0
      place(problem%order) = [(i, i=1, size(problem%order))]
      allocate (problem%tabled(0))
      do i = 1, size(model%rotor%bearing)
         associate (bearing => model%rotor%bearing(i))
            if (.not. allocated(bearing%table)) cycle
            associate (at => model%numbering%of(bearing%shaft, bearing%node))
               problem%tabled = [problem%tabled, &
                                 tabled_t(bearing%table, model%rotor%shaft(bearing%shaft)%speed_ratio, place(at(2:3)))]
            end associate
         end associate
      end do
   end subroutine find_tables

   !> Omega G, with damping B + Bx + Omega G; with `rate` the derivative by Omega.
   function damping_at(self, speed, rate) result(damping)
      class(banded_whirl_t), intent(in) :: self
      real(wp), intent(in) :: speed
      logical, intent(in) :: rate
      type(band_t) :: damping

      damping = self%gyroscopic
      damping%entry = merge(1.0_wp, speed, rate)*damping%entry
      if (.not. self%damped) return
      if (.not. rate) damping%entry = damping%entry + self%damping%entry
      call add_tables(damping, self%tabled, speed, .true., rate, .true.)
   end function damping_at

   !> K, with damping K + Kx, with Omega C if C acts, and what bearings have more than at their first speeds; with `rate` the
   !> derivative by Omega.
   function stiffness_at(self, speed, rate) result(stiffness)
      class(banded_whirl_t), intent(in) :: self
      real(wp), intent(in) :: speed
      logical, intent(in) :: rate
      type(band_t) :: stiffness

      stiffness = self%stiffness
      if (rate) stiffness%entry = 0.0_wp
      call add_tables(stiffness, self%tabled, speed, .false., rate, self%damped)
      if (self%damped .and. .not. rate) stiffness%entry = stiffness%entry + self%cross_stiffness%entry
      if (self%circulatory) stiffness%entry = stiffness%entry + merge(1.0_wp, speed, rate)*self%circulation%entry
   end function stiffness_at

   !> Add what tables of bearings say, the symmetric part alone where `skew` is not asked for.
   pure subroutine add_tables(band, tabled, speed, damping, rate, skew)
      type(band_t), intent(inout) :: band
      type(tabled_t), intent(in) :: tabled(:)
      real(wp), intent(in) :: speed
      logical, intent(in) :: damping, rate, skew

      real(wp) :: part(2, 2)
      integer :: i, j, k

      do i = 1, size(tabled)
         part = transpose(reshape(table_change(tabled(i)%table, tabled(i)%ratio, speed, damping, merge(1, 0, rate)), [2, 2]))
         if (.not. skew) part = 0.5_wp*(part + transpose(part))
         associate (at => tabled(i)%at)
            do k = 1, 2
               do j = 1, 2
                  if (at(j) == 0 .or. at(k) == 0) cycle
                  associate (entry => band%entry(band%width + 1 + at(j) - at(k), at(k)))
                     entry = entry + part(j, k)
                  end associate
               end do
            end do
         end associate
      end do
   end subroutine add_tables

   !> Eigenvalues with imaginary part >= 0, 1/s and rad/s, in the order of their imaginary parts, equal ones by the real part, and
   !> shapes at the angular speed `parameter` of the system, rad/s.
   subroutine solve(self, parameter, spectrum, error)
      class(banded_whirl_t), intent(inout) :: self
      real(wp), intent(in) :: parameter
      type(spectrum_t), intent(out) :: spectrum
      type(error_t), allocatable, intent(out) :: error

      complex(wp), allocatable :: shape(:, :), value(:), vector(:, :)
      integer, allocatable :: order(:)
      integer :: i
      logical :: found

      self%disc%damping = self%damping_at(parameter, rate=.false.)
      self%disc%stiffness = self%stiffness_at(parameter, rate=.false.)
      call self%disc%solve(self%least, self%reach, value, vector, found)
      if (.not. found) call raise(error, "an eigenproblem could not be solved")
      if (allocated(error)) return
      order = rising_order(value%re)
      order = order(rising_order(value(order)%im))
      allocate (shape, mold=vector)
      do i = 1, size(order)
         shape(:, i) = self%shape_from(vector(:, order(i)))
         shape(:, i) = shape(:, i)/norm2(abs(shape(:, i)))
      end do
      spectrum = new_spectrum(parameter, value(order), shape, equal, 0.0_wp)
   end subroutine solve

   function shape_of(self, shape) result(moved)
      class(banded_whirl_t), intent(in) :: self
      complex(wp), intent(in) :: shape(:)
      complex(wp), allocatable :: moved(:)

      allocate (moved, mold=shape)
      moved(self%order) = self%vector_of(shape)
   end function shape_of

   function vector_of(self, from) result(to)
      class(banded_whirl_t), intent(in) :: self
      complex(wp), intent(in) :: from(:)
      complex(wp) :: to(size(from))

      to = through_metric(self, from, "T", .true.)
   end function vector_of

   function shape_from(self, from) result(to)
      class(banded_whirl_t), intent(in) :: self
      complex(wp), intent(in) :: from(:)
      complex(wp) :: to(size(from))

      to = through_metric(self, from, "T", .false.)
   end function shape_from

   !> L x (n), or with `turn` "T" Lᵀ x, or with `inverse` L⁻¹ x or L⁻ᵀ x, L being the factor of the metric.
   function through_metric(self, from, turn, inverse) result(to)
      class(banded_whirl_t), intent(in) :: self
      complex(wp), intent(in) :: from(:)
      character, intent(in) :: turn
      logical, intent(in) :: inverse
      complex(wp) :: to(size(from))

      real(wp) :: part(size(from), 2)
      integer :: k

      part = reshape([from%re, from%im], shape(part))
      associate (n => size(from), height => size(self%metric, 1))
         do k = 1, 2
            if (inverse) then
               call dtbsv("L", turn, "N", n, height - 1, self%metric, height, part(:, k), 1)
            else
               call dtbmv("L", turn, "N", n, height - 1, self%metric, height, part(:, k), 1)
            end if
         end do
      end associate
      to = cmplx(part(:, 1), part(:, 2), wp)
   end function through_metric

   !> See `whirl_family_t`.
   subroutine newton(self, lambda, speed, u, right, info)
      class(banded_whirl_t), intent(in) :: self
      complex(wp), intent(in) :: lambda, u(:)
      real(wp), intent(in) :: speed
      complex(wp), intent(out) :: right(:, :)
      integer, intent(out) :: info

      type(band_t) :: damping
      type(complex_band_lu_t) :: factor

      damping = self%damping_at(speed, rate=.false.)
      right(:, 1) = product_of(damping, u) + 2*lambda*product_of(self%disc%mass, u)
      right(:, 2) = lambda*product_of(self%damping_at(speed, rate=.true.), u) + product_of(self%stiffness_at(speed, rate=.true.), u)
      call factor%factor(self%stiffness_at(speed, rate=.false.), damping, self%disc%mass, lambda, info)
      if (info == 0) call factor%solve(right)
   end subroutine newton

   !> See `whirl_family_t`.
   function forms_of(self, speed, u) result(forms)
      class(banded_whirl_t), intent(in) :: self
      real(wp), intent(in) :: speed
      complex(wp), intent(in) :: u(:)
      type(forms_t) :: forms

      type(band_t) :: cross, damping

      damping = self%damping
      call add_tables(damping, self%tabled, speed, .true., .false., .true.)
      cross = self%stiffness_at(speed, rate=.false.)
      cross%entry = cross%entry - self%stiffness%entry
      forms%mass = real(dot_product(u, product_of(self%disc%mass, u)), wp)
      forms%stiffness = real(dot_product(u, product_of(self%stiffness, u) + product_of(cross, u)), wp)
      forms%damping = real(dot_product(u, product_of(damping, u)), wp)
      forms%cross = aimag(dot_product(u, product_of(cross, u)))
      forms%cross_reach = norm2(abs(through_metric(self, product_of(cross, u), "N", .true.)))*norm2(abs(self%shape_from(u)))
      damping%entry = abs(damping%entry)
      cross%entry = abs(cross%entry)
      associate (moved => cmplx(abs(u), 0.0_wp, wp))
         forms%damping_terms = real(dot_product(moved, product_of(damping, moved)), wp)
         forms%cross_terms = real(dot_product(moved, product_of(cross, moved)), wp)
      end associate
   end function forms_of

   !> A u for a complex u (n).
   function product_of(band, u) result(image)
      type(band_t), intent(in) :: band
      complex(wp), intent(in) :: u(:)
      complex(wp) :: image(size(u))

      real(wp) :: part(size(u), 2)

      part = 0.0_wp
      call band%add_times(u%re, part(:, 1))
      call band%add_times(u%im, part(:, 2))
      image = cmplx(part(:, 1), part(:, 2), wp)
   end function product_of

end module razy_rotor_whirl_banded
