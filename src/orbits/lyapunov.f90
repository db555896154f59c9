!! Lyapunov exponents: mean growth of disturbances carried along a motion, orthonormalised again after each interval
!! (G. Benettin, L. Galgani, A. Giorgilli, J.-M. Strelcyn, Meccanica 15 (1980) 9-30), through events by their saltation matrices.
module razy_orbits_lyapunov
   use, intrinsic :: ieee_arithmetic, only: ieee_negative_inf, ieee_quiet_nan, ieee_value
   use razy_core_kinds, only: i8, wp
   use razy_core_table, only: table_t
   use razy_hybrid_flow, only: flow_t
   use razy_motion_integrator, only: observer_slot_t, outcome_t, status_ok
   use razy_orbits_volume, only: volume_t
   implicit none(type, external)
   private

   public :: lyapunov_t

   !> Exponents, 1/s, descending (asked for; NaN: the motion has not as many, or was not followed; -infinity: lost, by sticking or
   !> an impact without restitution, or in the rounding of the others).
   type :: lyapunov_t
      !> Number asked for, 0: none; intervals.
      integer :: asked = 0, intervals = 0
      real(wp), allocatable :: exponent(:), error(:)
      !> Kaplan-Yorke dimension; NaN where too few exponents were asked for.
      real(wp) :: dimension = 0.0_wp
      !> What all exponents together have to be, by the trace and the impacts, 1/s; NaN where this rule is not known, or too few
      !> exponents were asked for.
      real(wp), private :: sum_rule = 0.0_wp
   contains
      procedure :: forget
      procedure :: follow
      procedure :: columns
   end type lyapunov_t

   !> Parts of the whole, by whose scatter the error is told.
   integer, parameter :: blocks = 10
   integer(i8), parameter :: most_events = 1000000_i8
   !> Columns that shrink below the first part in an interval are lost, and those of which no more than the second, which is
   !> rounding, is not along those before them.
   real(wp), parameter :: lost = 1.0e-100_wp, own = 1.0e4_wp*epsilon(1.0_wp)

contains

   !> Nothing was followed.
   subroutine forget(self)
      class(lyapunov_t), intent(inout) :: self

      self%exponent = spread(ieee_value(1.0_wp, ieee_quiet_nan), 1, self%asked)
      self%error = self%exponent
      self%dimension = ieee_value(1.0_wp, ieee_quiet_nan)
      self%sum_rule = ieee_value(1.0_wp, ieee_quiet_nan)
   end subroutine forget

   !> Follow a prepared flow from the state z, at the phase of excitation that the machine begins with, over intervals of
   !> `interval`, s: a period of the excitation, after each of which the same phase comes again.
   subroutine follow(self, by, z, interval)
      class(lyapunov_t), intent(inout) :: self
      class(flow_t), intent(inout) :: by
      real(wp), intent(in) :: z(:), interval

      type(observer_slot_t), allocatable :: observers(:)
      type(outcome_t) :: outcome
      type(volume_t), target :: volume
      real(wp), allocatable :: growth(:, :), q(:, :)
      integer :: block, i, k, n

      call self%forget()
      k = min(self%asked, size(z))
      n = max(1, self%intervals/blocks)
      allocate (growth(k, blocks), source=0.0_wp)
      allocate (q(size(z), k), source=0.0_wp)
      ! Any directions will do; these are not those of one coordinate.
      do i = 1, k
         q(:, i) = [(cos(real(i*block, wp)), block=1, size(z))]
      end do
      call orthonormalise(q)
      allocate (observers(merge(1, 0, k == size(z))))
      if (k == size(z)) observers(1)%observer => volume
      call volume%begin(by)
      by%first = z
      blockwise: do block = 1, blocks
         do i = 1, n
            by%tangent = q
            by%budget%goes_on = block*i > 1
            call by%run(interval, most_events, observers, outcome)
            by%budget%goes_on = .false.
            if (outcome%status /= status_ok) exit blockwise
            by%first = by%z
            q = by%tangent
            call orthonormalise(q, growth(:, block))
         end do
      end do blockwise
      deallocate (by%tangent, by%first)
      if (outcome%status /= status_ok) return
      growth = growth/(n*interval)
      self%exponent(:k) = sum(growth, dim=2)/blocks
      self%error(:k) = sqrt(sum((growth - spread(self%exponent(:k), 2, blocks))**2, dim=2)/(blocks*(blocks - 1)))
      where (self%exponent(:k) < log(lost)/interval/2) self%exponent(:k) = ieee_value(1.0_wp, ieee_negative_inf)
      if (k == size(z)) self%sum_rule = volume%logarithm/(blocks*n*interval)
      self%dimension = kaplan_yorke(self%exponent(:k), k == size(z))
   end subroutine follow

   !> Make the columns orthonormal, each against those before it, and add the logarithms of what is left of them.
   pure subroutine orthonormalise(q, growth)
      real(wp), intent(inout) :: q(:, :)
      real(wp), intent(inout), optional :: growth(:)

      real(wp) :: length, whole
      integer :: i, pass

      do i = 1, size(q, 2)
         whole = norm2(q(:, i))
         do pass = 1, 2
            q(:, i) = q(:, i) - matmul(q(:, :i - 1), matmul(q(:, i), q(:, :i - 1)))
         end do
         length = norm2(q(:, i))
         if (length <= own*whole) length = 0.0_wp
         if (present(growth)) growth(i) = growth(i) + log(max(length, lost))
         if (length > lost) then
            q(:, i) = q(:, i)/length
         else
            q(:, i) = 0.0_wp
         end if
      end do
   end subroutine orthonormalise

   !> j + Σ_{i≤j} λ_i/|λ_{j+1}| with the largest j whose sum is not negative; `all`: there are no more exponents.
   pure real(wp) function kaplan_yorke(exponent, all) result(dimension)
      real(wp), intent(in) :: exponent(:)
      logical, intent(in) :: all

      real(wp) :: total
      integer :: j

      total = 0.0_wp
      do j = 1, size(exponent)
         dimension = j - 1 + merge(total/abs(exponent(j)), 0.0_wp, abs(exponent(j)) > 0.0_wp)
         total = total + exponent(j)
         if (total < 0.0_wp) return
      end do
      dimension = merge(real(size(exponent), wp), ieee_value(1.0_wp, ieee_quiet_nan), all)
   end function kaplan_yorke

   !> Hand over the exponents.
   subroutine columns(self, table)
      class(lyapunov_t), intent(in) :: self
      type(table_t), intent(inout) :: table

      character(*), parameter :: group = "/lyapunov/"

      call table%add(group//"exponent", self%exponent, "1/s", "Lyapunov exponents, descending", group//"order", fixed=.true.)
      call table%add(group//"error", self%error, "1/s", "standard error of the exponents, by the scatter of tenths of the time", &
                     group//"order", fixed=.true.)
      call table%add(group//"dimension", self%dimension, "1", "Kaplan-Yorke dimension")
      call table%add(group//"sum_rule", self%sum_rule, "1/s", "sum of all exponents by the trace of the damping and the impacts")
   end subroutine columns

end module razy_orbits_lyapunov
