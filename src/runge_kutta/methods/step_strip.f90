!! Steps of one length in a row, made by their map (razy_runge_kutta_methods_step_maps): argument, end and error of each,
!! before anybody has said whether they are accepted.
module razy_runge_kutta_methods_step_strip
   use razy_core_kinds, only: wp
   use razy_hybrid_field, only: field_t
   use razy_runge_kutta_methods_stage_sums, only: multiply, scaled_error, width
   implicit none(type, external)
   private

   public :: longest_strip, step_strip_t

   !> Most steps. Phases are carried on from step to step, each adds a rounding.
   integer, parameter :: longest_strip = 8

   type :: step_strip_t
      !> Steps made, and those before the strip since its phases were formed anew.
      integer :: count = 0, carried = 0
      !> Whether there is one more, which is refused.
      logical :: refused = .false.
      !> Length of each, s; their ends after the start of the strip, s (0: longest_strip), and errors (longest_strip).
      real(wp) :: h = 0.0_wp, at(0:longest_strip) = 0.0_wp, error(longest_strip) = 0.0_wp
      !> States (n, 0: longest_strip), and slopes and phases there, which are the arguments of the maps (columns, likewise).
      real(wp), allocatable :: z(:, :), u(:, :)
      !> What the map gave (rows, longest_strip).
      real(wp), allocatable, private :: ends(:, :)
   contains
      procedure :: begin
      procedure :: walk
      procedure :: judge
   end type step_strip_t

contains

   !> Begin at z with the slope dz (n each) and the phases of the field's step, for maps of `rows` and steps h.
   pure subroutine begin(self, field, rows, h, z, dz)
      class(step_strip_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      integer, intent(in) :: rows
      real(wp), intent(in) :: h
      real(wp), intent(in), contiguous :: z(:), dz(:)

      integer :: columns, i, n, tones

      n = size(z)
      tones = size(field%omega)
      columns = n + 2*tones
      if (allocated(self%z)) then
         if (size(self%z, 1) /= n .or. size(self%u, 1) /= columns .or. size(self%ends, 1) /= rows) then
            deallocate (self%z, self%u, self%ends)
         end if
      end if
      if (.not. allocated(self%z)) then
         allocate (self%z(n, 0:longest_strip), self%u(columns, 0:longest_strip), self%ends(rows, longest_strip))
      end if
      self%count = 0
      self%carried = field%carried
      self%h = h
      do i = 1, longest_strip
         self%at(i) = self%at(i - 1) + h
      end do
      do i = 1, n
         self%z(i, 0) = z(i)
         self%u(i, 0) = dz(i)
      end do
      do i = 1, tones
         self%u(n + i, 0) = field%base_cosine(i)
         self%u(n + tones + i, 0) = field%base_sine(i)
      end do
   end subroutine begin

   !> Go on up to step `last`, by the map `ends` (width, columns, blocks); cosine and sine are those of the angles of excitation in
   !> a step (tones each).
   pure subroutine walk(self, field, last, ends, cosine, sine)
      class(step_strip_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      integer, intent(in) :: last
      real(wp), intent(in), contiguous :: ends(:, :, :), cosine(:), sine(:)

      call follow(field%m, size(cosine), size(ends, 3), self%count + 1, last, ends, field%matrix, field%constant, field%on_cosine, &
                  field%on_sine, cosine, sine, self%z, self%u, self%ends)
   end subroutine walk

   !> Of each step change and errors by the map, state, phases, and slope there.
   pure subroutine follow(m, tones, blocks, first, last, map, matrix, constant, on_cosine, on_sine, cosine, sine, z, u, ends)
      integer, intent(in) :: m, tones, blocks, first, last
      real(wp), intent(in) :: map(width, 2*(m + tones), blocks), matrix(m, 2*m), constant(m), on_cosine(m, tones), &
                              on_sine(m, tones), cosine(tones), sine(tones)
      real(wp), intent(inout) :: z(2*m, 0:longest_strip), u(2*(m + tones), 0:longest_strip), ends(width*blocks, longest_strip)

      real(wp) :: a
      integer :: i, j, k, n

      n = 2*m
      do k = first, last
         call multiply(blocks, n + 2*tones, map, u(:, k - 1), ends(:, k))
         do i = 1, n
            z(i, k) = z(i, k - 1) + ends(i, k)
         end do
         do j = n + 1, n + tones
            u(j, k) = u(j, k - 1)*cosine(j - n) - u(tones + j, k - 1)*sine(j - n)
            u(tones + j, k) = u(tones + j, k - 1)*cosine(j - n) + u(j, k - 1)*sine(j - n)
         end do
         if (m == 2) then
            call slope_of_two(tones, matrix, constant, on_cosine, on_sine, z(:, k), u(:, k))
            cycle
         end if
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
      end do
   end subroutine follow

   !> The slope for two coordinates.
   pure subroutine slope_of_two(tones, matrix, constant, on_cosine, on_sine, z, u)
      integer, intent(in) :: tones
      real(wp), intent(in) :: matrix(2, 4), constant(2), on_cosine(2, tones), on_sine(2, tones), z(4)
      real(wp), intent(inout) :: u(4 + 2*tones)

      real(wp) :: a(2)
      integer :: j

      a = constant
      do j = 1, tones
         a = a + (on_cosine(:, j)*u(4 + j) + on_sine(:, j)*u(4 + tones + j))
      end do
      a = a - matrix(:, 1)*z(1)
      a = a - matrix(:, 2)*z(2)
      a = a - matrix(:, 3)*z(3)
      a = a - matrix(:, 4)*z(4)
      u(1) = z(3)
      u(2) = z(4)
      u(3) = a(1)
      u(4) = a(2)
   end subroutine slope_of_two

   !> The errors in units of the tolerance up to step `last`, from so many `estimates` of each; takes those before the first that is
   !> `refused`.
   pure subroutine judge(self, last, estimates, absolute, relative)
      class(step_strip_t), intent(inout) :: self
      integer, intent(in) :: last, estimates
      real(wp), intent(in) :: absolute, relative

      call judge_steps(size(self%z, 1), size(self%ends, 1), estimates, self%ends, self%z, absolute, relative, last, self%count, &
                       self%error)
      self%refused = self%count < last
   end subroutine judge

   pure subroutine judge_steps(n, rows, estimates, ends, z, absolute, relative, last, count, error)
      integer, intent(in) :: n, rows, estimates, last
      real(wp), intent(in) :: ends(rows, longest_strip), z(n, 0:longest_strip), absolute, relative
      integer, intent(inout) :: count
      real(wp), intent(inout) :: error(longest_strip)

      integer :: k

      do k = count + 1, last
         error(k) = scaled_error(n, n, estimates, ends(n + 1, k), z(1, k - 1), z(1, k), absolute, relative)
         if (.not. error(k) <= 1.0_wp) return
         count = k
      end do
   end subroutine judge_steps

end module razy_runge_kutta_methods_step_strip
