!! Steps in a row, made by their maps (razy_integrate_step_maps): argument, end and error of each, before anybody has said whether
!! they are accepted.
module razy_integrate_step_strip
   use razy_core_kinds, only: wp
   use razy_integrate_field, only: field_t
   use razy_integrate_stage_sums, only: multiply, scaled_error, width
   use razy_integrate_step_control, only: control_memory_t
   implicit none(type, external)
   private

   public :: longest_strip, step_strip_t

   !> Most steps. Phases are carried on from step to step, each adds a rounding.
   integer, parameter :: longest_strip = 8

   type :: step_strip_t
      !> Steps made.
      integer :: count = 0
      !> Ends of the steps after the start of the strip, s (0: longest_strip); length, s, error and map of each (longest_strip).
      real(wp) :: at(0:longest_strip) = 0.0_wp, h(longest_strip) = 0.0_wp, error(longest_strip) = 0.0_wp
      integer :: slot(longest_strip) = 0
      !> Step proposed after each, s, and what the step control remembers then (0: longest_strip).
      real(wp) :: next(0:longest_strip) = 0.0_wp
      type(control_memory_t) :: memory(0:longest_strip)
      !> States (n, 0: longest_strip), and slopes and phases there, which are the arguments of the maps (columns, likewise).
      real(wp), allocatable :: z(:, :), u(:, :)
      !> What the last map gave (rows).
      real(wp), allocatable, private :: ends(:)
   contains
      procedure :: begin
      procedure :: add
      procedure :: judge
   end type step_strip_t

contains

   !> Begin at z with the slope dz (n each) and the phases of the field's step; maps have `errors` estimates.
   pure subroutine begin(self, field, errors, z, dz)
      class(step_strip_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      integer, intent(in) :: errors
      real(wp), intent(in), contiguous :: z(:), dz(:)

      integer :: columns, i, n, rows, tones

      n = size(z)
      tones = size(field%omega)
      columns = n + 2*tones
      rows = width*((n*(1 + errors) + width - 1)/width)
      if (allocated(self%z)) then
         if (size(self%z, 1) /= n .or. size(self%u, 1) /= columns .or. size(self%ends) /= rows) then
            deallocate (self%z, self%u, self%ends)
         end if
      end if
      if (.not. allocated(self%z)) then
         allocate (self%z(n, 0:longest_strip), self%u(columns, 0:longest_strip), self%ends(rows))
      end if
      self%count = 0
      do i = 1, n
         self%z(i, 0) = z(i)
         self%u(i, 0) = dz(i)
      end do
      do i = 1, tones
         self%u(n + i, 0) = field%base_cosine(i)
         self%u(n + tones + i, 0) = field%base_sine(i)
      end do
   end subroutine begin

   !> Make one more step, of h by the map `ends` (width, columns, blocks) kept in `slot`; cosine and sine are those of the angles of
   !> excitation in it.
   pure subroutine add(self, field, h, slot, blocks, ends, cosine, sine)
      class(step_strip_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      real(wp), intent(in) :: h
      integer, intent(in) :: slot, blocks
      real(wp), intent(in) :: ends(*), cosine(*), sine(*)

      integer :: k

      k = self%count + 1
      self%count = k
      self%h(k) = h
      self%slot(k) = slot
      self%at(k) = self%at(k - 1) + h
      call follow(field%m, size(field%omega), blocks, k, ends, field%matrix, field%constant, field%on_cosine, field%on_sine, &
                  cosine, sine, self%z, self%u, self%ends)
   end subroutine add

   !> Step k: change and errors by the map, state, phases, and slope there.
   pure subroutine follow(m, tones, blocks, k, map, matrix, constant, on_cosine, on_sine, cosine, sine, z, u, ends)
      integer, intent(in) :: m, tones, blocks, k
      real(wp), intent(in) :: map(width, 2*(m + tones), blocks), matrix(m, 2*m), constant(m), on_cosine(m, tones), &
                              on_sine(m, tones), cosine(tones), sine(tones)
      real(wp), intent(inout) :: z(2*m, 0:longest_strip), u(2*(m + tones), 0:longest_strip), ends(width*blocks)

      real(wp) :: a
      integer :: i, j, n

      n = 2*m
      call multiply(blocks, n + 2*tones, map, u(:, k - 1), ends)
      do i = 1, n
         z(i, k) = z(i, k - 1) + ends(i)
      end do
      do j = n + 1, n + tones
         u(j, k) = u(j, k - 1)*cosine(j - n) - u(tones + j, k - 1)*sine(j - n)
         u(tones + j, k) = u(tones + j, k - 1)*cosine(j - n) + u(j, k - 1)*sine(j - n)
      end do
      do i = 1, m
         a = constant(i)
         do j = 1, tones
            a = a + (on_cosine(i, j)*u(n + j, k) + on_sine(i, j)*u(n + tones + j, k))
         end do
         do j = 1, n
            a = a - matrix(i, j)*z(j, k)
         end do
         u(i, k) = z(m + i, k)
         u(m + i, k) = a
      end do
   end subroutine follow

   !> The error of the last step in units of the tolerance, from so many `estimates`; it is taken back unless it is `accepted`.
   pure subroutine judge(self, estimates, absolute, relative, accepted)
      class(step_strip_t), intent(inout) :: self
      integer, intent(in) :: estimates
      real(wp), intent(in) :: absolute, relative
      logical, intent(out) :: accepted

      integer :: n

      n = size(self%z, 1)
      associate (k => self%count)
         self%error(k) = scaled_error(n, n, estimates, self%ends(n + 1:), self%z(:, k - 1), self%z(:, k), absolute, relative)
         accepted = self%error(k) <= 1.0_wp
      end associate
      if (.not. accepted) self%count = self%count - 1
   end subroutine judge

end module razy_integrate_step_strip
